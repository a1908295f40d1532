/* SPDX-FileCopyrightText: 2026 The arm and quad developers */
/* SPDX-License-Identifier: Apache-2.0 */

/* Whether motions of a scene are free: bounds of distances, edges, paths and RRT-Connect.

   A distance here is a lower bound that is its own proof: for any unit vector n, the gap between
   min n.b of one shape and max n.a of the other. GJK only chooses n, so nothing depends on its
   convergence: "free" is certain, "not free" may be cautious where it did not converge.

   Conventions: lengths in [m], angles in [rad]. A placement is 12 numbers, the rotation by rows and
   the origin. One world belongs to one thread. Functions that can fail for want of memory return
   -1 or a null pointer. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BOX, POINT, SEGMENT, CYLINDER, CONE, HULL, HALF_SPACE };
enum { MAX_GJK = 64 };

#define CONVERGED 1e-5      /* gap between bounds of a distance that ends GJK [m] */
#define CONVERGED_NEAR 1e-8 /* the same where shapes nearly touch [m] */
#define NEAR 3e-3           /* what counts as nearly [m] */
#undef HUGE
#define HUGE 1e300          /* more than any length */
#define OVERLAP -1.0        /* what stands for the distance of shapes that overlap [m] */
#define MIN_MARGIN 1e-4     /* motion within a part that is not cut any further [m] */
#define FAR 0.01            /* with a quarter of what is asked for: a bound that will do [m] */
#define SAME 1e-9           /* distance of states that are one [rad] */

typedef struct {
  int kind, joint;           /* joint: column that moves it, -1 for none */
  int first, count;          /* points of a hull */
  double size[4];            /* half lengths, or radius and half length, or plane */
  double swept;              /* how far the shape reaches beyond what the above describes */
  double local[12], world[12];
  double middle[3], radius;  /* sphere that holds it, in its own frame; radius < 0 for none */
  double center[3];          /* middle of that in the root link */
} Shape;

typedef struct {
  int first, second;
  double direction[3]; /* last one that parted them, in the frame of the first */
} Pair;

typedef struct {
  double middle, half;
  int first, count; /* of the pairs in doubt, in the arena */
} Part;

typedef struct {
  int joints, columns, shapes, pairs, points;
  double *factors, *offsets, *placements, *axes, *poses;
  int *parents, *slides;
  Shape *shape;
  Pair *pair;
  double *x, *y, *z, *dots; /* points of hulls, by coordinate */
  double *rates;            /* how fast each joint changes a pair's distance at most */
  double *motions, *left, *state, *way, *turns; /* turns: four rows */
  Part *parts;
  int part_room;
  int *arena;
  int arena_room;
  int hit; /* pair that was found too near last */
} World;

static double dot(const double *a, const double *b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double *a, const double *b, double *out) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

static void minus(const double *a, const double *b, double *out) {
  for (int i = 0; i < 3; i++) out[i] = a[i] - b[i];
}

static void turn(const double *m, const double *v, double *out) {
  for (int i = 0; i < 3; i++) out[i] = m[3 * i] * v[0] + m[3 * i + 1] * v[1] + m[3 * i + 2] * v[2];
}

static void turn_back(const double *m, const double *v, double *out) {
  for (int i = 0; i < 3; i++) out[i] = m[i] * v[0] + m[3 + i] * v[1] + m[6 + i] * v[2];
}

static void compose(const double *a, const double *b, double *out) {
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++)
      out[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
  }
  turn(a, b + 9, out + 9);
  for (int i = 0; i < 3; i++) out[9 + i] += a[9 + i];
}

/* The farthest point of a shape along a direction, in its own frame. */
static void support(const World *w, const Shape *s, const double *d, double *out) {
  double across, half;
  out[0] = out[1] = out[2] = 0.0;
  switch (s->kind) {
    case BOX:
      for (int i = 0; i < 3; i++) out[i] = d[i] < 0.0 ? -s->size[i] : s->size[i];
      break;
    case SEGMENT:
      out[2] = d[2] < 0.0 ? -s->size[1] : s->size[1];
      break;
    case CYLINDER:
    case CONE:
      across = hypot(d[0], d[1]);
      half = s->size[1];
      if (s->kind == CONE && d[2] * 2.0 * half >= across * s->size[0]) {
        out[2] = half;
        break;
      }
      out[2] = s->kind == CONE || d[2] < 0.0 ? -half : half;
      if (across > 0.0) {
        out[0] = d[0] * s->size[0] / across;
        out[1] = d[1] * s->size[0] / across;
      }
      break;
    case HULL: {
      const double *x = w->x + s->first, *y = w->y + s->first, *z = w->z + s->first;
      double *restrict dots = w->dots, best = -HUGE;
      int place = 0;
      for (int i = 0; i < s->count; i++) {
        double there = x[i] * d[0] + y[i] * d[1] + z[i] * d[2];
        dots[i] = there;
        best = there > best ? there : best;
      }
      while (dots[place] < best) place++;
      out[0] = x[place], out[1] = y[place], out[2] = z[place];
      break;
    }
    default:
      break;
  }
}

/* The farthest point of the second shape less that of the first, along -d, in the first's frame. */
static void difference(const World *w, const Shape *a, const Shape *b, const double *b_in_a,
                       const double *d, double *out) {
  double in_b[3], back[3], pa[3], pb[3];
  for (int i = 0; i < 3; i++) back[i] = -d[i];
  turn_back(b_in_a, back, in_b);
  support(w, b, in_b, pb);
  turn(b_in_a, pb, out);
  support(w, a, d, pa);
  for (int i = 0; i < 3; i++) out[i] += b_in_a[9 + i] - pa[i];
}

/* Reduce a triangle to what holds its point that is nearest to the origin; Ericson, 5.1.5. */
static int nearest_on_triangle(const double *a, const double *b, const double *c, double *share) {
  double ab[3], ac[3], d1, d2, d3, d4, d5, d6, va, vb, vc, sum;
  minus(b, a, ab), minus(c, a, ac);
  d1 = -dot(ab, a), d2 = -dot(ac, a), d3 = -dot(ab, b), d4 = -dot(ac, b);
  d5 = -dot(ab, c), d6 = -dot(ac, c);
  share[0] = share[1] = share[2] = 0.0;
  if (d1 <= 0.0 && d2 <= 0.0) return share[0] = 1.0, 1;
  if (d3 >= 0.0 && d4 <= d3) return share[1] = 1.0, 1;
  vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    share[1] = d1 / (d1 - d3), share[0] = 1.0 - share[1];
    return 1;
  }
  if (d6 >= 0.0 && d5 <= d6) return share[2] = 1.0, 1;
  vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    share[2] = d2 / (d2 - d6), share[0] = 1.0 - share[2];
    return 1;
  }
  va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    share[2] = (d4 - d3) / ((d4 - d3) + (d5 - d6)), share[1] = 1.0 - share[2];
    return 1;
  }
  sum = va + vb + vc;
  if (!(sum > 0.0)) return 0;
  share[1] = vb / sum, share[2] = vc / sum, share[0] = 1.0 - share[1] - share[2];
  return 1;
}

/* Reduce a simplex to what holds its point v that is nearest to the origin; 0 where the origin is
   inside, -1 where numbers do not suffice. */
static int reduce(double simplex[4][3], int count, double *v) {
  static const int faces[4][4] = {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};
  double share[4] = {1.0, 0.0, 0.0, 0.0}, kept[4][3];
  int which[4] = {0, 1, 2, 3}, left = 0;
  if (count == 2) {
    double ab[3], length;
    minus(simplex[1], simplex[0], ab);
    length = dot(ab, ab);
    share[1] = length > 0.0 ? fmin(fmax(-dot(simplex[0], ab) / length, 0.0), 1.0) : 0.0;
    share[0] = 1.0 - share[1];
  } else if (count == 3) {
    if (!nearest_on_triangle(simplex[0], simplex[1], simplex[2], share)) return -1;
  } else if (count == 4) {
    double best = HUGE;
    int outside = 0;
    for (int face = 0; face < 4; face++) {
      const double *a = simplex[faces[face][0]], *b = simplex[faces[face][1]];
      const double *c = simplex[faces[face][2]], *d = simplex[faces[face][3]];
      double ab[3], ac[3], ad[3], normal[3], there[3], part[3], here, beyond;
      minus(b, a, ab), minus(c, a, ac), minus(d, a, ad);
      cross(ab, ac, normal);
      here = -dot(a, normal), beyond = dot(ad, normal);
      if (here * beyond > 0.0) continue; /* the origin lies where the fourth corner does */
      if (!nearest_on_triangle(a, b, c, part)) return -1;
      outside = 1;
      for (int i = 0; i < 3; i++) there[i] = part[0] * a[i] + part[1] * b[i] + part[2] * c[i];
      if (dot(there, there) < best) {
        best = dot(there, there);
        memcpy(which, faces[face], sizeof which);
        for (int i = 0; i < 3; i++) share[i] = part[i];
      }
    }
    if (!outside) return 0;
    count = 3;
  }
  v[0] = v[1] = v[2] = 0.0;
  for (int i = 0; i < count; i++) {
    if (share[i] <= 0.0) continue;
    memcpy(kept[left++], simplex[which[i]], sizeof kept[0]);
    for (int j = 0; j < 3; j++) v[j] += share[i] * simplex[which[i]][j];
  }
  memcpy(simplex, kept, sizeof kept);
  return left;
}

/* A lower bound of the distance of a pair: at least `enough`, or exact but for CONVERGED. */
static double distance(World *w, int number, double enough) {
  Pair *pair = w->pair + number;
  const Shape *a = w->shape + pair->first, *b = w->shape + pair->second;
  double swept = a->swept + b->swept, least = -HUGE, b_in_a[12], apart[3], v[3];
  double simplex[4][3];
  int count = 0;
  if (a->kind == HALF_SPACE || b->kind == HALF_SPACE) {
    const Shape *plane = a->kind == HALF_SPACE ? a : b, *other = a->kind == HALF_SPACE ? b : a;
    double normal[3], down[3], in_other[3], point[3], there[3], origin[3];
    turn(plane->world, plane->size, normal);
    for (int i = 0; i < 3; i++) down[i] = -normal[i];
    turn_back(other->world, down, in_other);
    support(w, other, in_other, point);
    turn(other->world, point, there);
    for (int i = 0; i < 3; i++) there[i] += other->world[9 + i];
    memcpy(origin, plane->world + 9, sizeof origin);
    return dot(normal, there) - dot(normal, origin) - plane->size[3] - swept;
  }
  minus(b->center, a->center, apart);
  least = sqrt(dot(apart, apart)) - a->radius - b->radius; /* which hold what is swept, too */
  if (least >= enough) return least;
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) {
      b_in_a[3 * i + j] = a->world[i] * b->world[j] + a->world[3 + i] * b->world[3 + j] +
                          a->world[6 + i] * b->world[6 + j];
    }
  }
  minus(b->world + 9, a->world + 9, apart);
  turn_back(a->world, apart, b_in_a + 9);
  memcpy(v, pair->direction, sizeof v);
  if (dot(v, v) == 0.0) turn_back(a->world, apart, v);
  if (dot(v, v) == 0.0) v[0] = 1.0;
  for (int step = 0; step < MAX_GJK; step++) {
    double length = sqrt(dot(v, v)), d[3], gap, most = length - swept;
    int known = 0;
    for (int i = 0; i < 3; i++) d[i] = v[i] / length;
    difference(w, a, b, b_in_a, d, simplex[count]);
    gap = dot(d, simplex[count]) - swept;
    if (gap > least) {
      least = gap;
      memcpy(pair->direction, d, sizeof d);
      if (least >= enough) return least;
    }
    if (count && most - least <= (least < NEAR ? CONVERGED_NEAR : CONVERGED)) return least;
    for (int i = 0; i < count; i++) {
      double again[3];
      minus(simplex[i], simplex[count], again);
      known = known || dot(again, again) < 1e-24;
    }
    if (known) return least;
    count = reduce(simplex, count + 1, v);
    if (count == 0) return fmin(least, OVERLAP);
    if (count < 0) return least;
    length = sqrt(dot(v, v));
    if (length < 1e-10) return fmin(least, OVERLAP);
    if (step && length - swept >= most - 1e-14) return least; /* no nearer any more */
  }
  return least;
}

/* Put all shapes where the joints have them. */
static void place(World *w, const double *q) {
  for (int c = 0; c < w->columns; c++) {
    double at = w->offsets[c], motion[12], there[12];
    const double *axis = w->axes + 3 * c;
    for (int j = 0; j < w->joints; j++) at += w->factors[c * w->joints + j] * q[j];
    memset(motion, 0, sizeof motion);
    if (w->slides[c]) {
      motion[0] = motion[4] = motion[8] = 1.0;
      for (int i = 0; i < 3; i++) motion[9 + i] = at * axis[i];
    } else {
      double s = sin(at), k = cos(at), x = axis[0], y = axis[1], z = axis[2], l = 1.0 - k;
      motion[0] = k + l * x * x, motion[1] = l * x * y - s * z, motion[2] = l * x * z + s * y;
      motion[3] = l * x * y + s * z, motion[4] = k + l * y * y, motion[5] = l * y * z - s * x;
      motion[6] = l * x * z - s * y, motion[7] = l * y * z + s * x, motion[8] = k + l * z * z;
    }
    if (w->parents[c] < 0) {
      memcpy(there, w->placements + 12 * c, sizeof there);
    } else {
      compose(w->poses + 12 * w->parents[c], w->placements + 12 * c, there);
    }
    compose(there, motion, w->poses + 12 * c);
  }
  for (int i = 0; i < w->shapes; i++) {
    Shape *s = w->shape + i;
    if (s->joint < 0) continue;
    compose(w->poses + 12 * s->joint, s->local, s->world);
    turn(s->world, s->middle, s->center);
    for (int j = 0; j < 3; j++) s->center[j] += s->world[9 + j];
  }
}

static double *doubles(int count) { return calloc(count > 0 ? count : 1, sizeof(double)); }
static int *ints(int count) { return calloc(count > 0 ? count : 1, sizeof(int)); }

void world_free(World *w) {
  if (!w) return;
  free(w->factors), free(w->offsets), free(w->placements), free(w->axes), free(w->poses);
  free(w->parents), free(w->slides), free(w->shape), free(w->pair), free(w->x), free(w->y);
  free(w->z), free(w->dots), free(w->rates), free(w->motions), free(w->left), free(w->state);
  free(w->way), free(w->turns), free(w->parts), free(w->arena), free(w);
}

/* Fill in the sphere that holds a shape, with what is swept. */
static void enclose(const World *w, Shape *s) {
  double low[3], high[3];
  const double *size = s->size;
  s->radius = 0.0;
  switch (s->kind) {
    case BOX: s->radius = sqrt(dot(size, size)); break;
    case SEGMENT: s->radius = size[1]; break;
    case CYLINDER:
    case CONE: s->radius = hypot(size[0], size[1]); break;
    case HULL:
      for (int j = 0; j < 3; j++) {
        const double *axis = j == 0 ? w->x : j == 1 ? w->y : w->z;
        low[j] = HUGE, high[j] = -HUGE;
        for (int i = s->first; i < s->first + s->count; i++)
          low[j] = fmin(low[j], axis[i]), high[j] = fmax(high[j], axis[i]);
        s->middle[j] = 0.5 * (low[j] + high[j]);
      }
      for (int i = s->first; i < s->first + s->count; i++) {
        double point[3] = {w->x[i], w->y[i], w->z[i]}, away[3];
        minus(point, s->middle, away);
        s->radius = fmax(s->radius, sqrt(dot(away, away)));
      }
      break;
    default: break;
  }
  s->radius += s->swept;
}

World *world_new(int joints, int columns, int shapes, int pairs, int points,
                 const double *factors, const double *offsets, const int *parents,
                 const int *slides, const double *placements, const double *axes,
                 const int *kinds, const int *movers, const double *locals, const double *sizes,
                 const double *swept, const int *starts, const double *corners,
                 const int *members, const double *rates) {
  World *w = calloc(1, sizeof *w);
  if (!w) return NULL;
  w->joints = joints, w->columns = columns, w->shapes = shapes, w->pairs = pairs;
  w->points = points, w->hit = -1;
  w->factors = doubles(columns * joints), w->offsets = doubles(columns);
  w->placements = doubles(12 * columns), w->axes = doubles(3 * columns);
  w->poses = doubles(12 * columns), w->parents = ints(columns), w->slides = ints(columns);
  w->shape = calloc(shapes + 1, sizeof *w->shape), w->pair = calloc(pairs + 1, sizeof *w->pair);
  w->x = doubles(points), w->y = doubles(points), w->z = doubles(points);
  w->dots = doubles(points), w->rates = doubles(pairs * joints), w->motions = doubles(pairs);
  w->left = doubles(pairs), w->state = doubles(joints), w->way = doubles(joints);
  w->turns = doubles(4 * joints), w->part_room = 64, w->arena_room = 4 * pairs + 64;
  w->parts = calloc(w->part_room, sizeof *w->parts), w->arena = ints(w->arena_room);
  if (!(w->factors && w->offsets && w->placements && w->axes && w->poses && w->parents &&
        w->slides && w->shape && w->pair && w->x && w->y && w->z && w->dots && w->rates &&
        w->motions && w->left && w->state && w->way && w->turns && w->parts && w->arena)) {
    world_free(w);
    return NULL;
  }
  memcpy(w->factors, factors, sizeof(double) * columns * joints);
  memcpy(w->offsets, offsets, sizeof(double) * columns);
  memcpy(w->parents, parents, sizeof(int) * columns);
  memcpy(w->slides, slides, sizeof(int) * columns);
  memcpy(w->placements, placements, sizeof(double) * 12 * columns);
  memcpy(w->axes, axes, sizeof(double) * 3 * columns);
  memcpy(w->rates, rates, sizeof(double) * pairs * joints);
  for (int i = 0; i < points; i++)
    w->x[i] = corners[3 * i], w->y[i] = corners[3 * i + 1], w->z[i] = corners[3 * i + 2];
  for (int i = 0; i < shapes; i++) {
    Shape *s = w->shape + i;
    s->kind = kinds[i], s->joint = movers[i], s->swept = swept[i];
    s->first = starts[i], s->count = starts[i + 1] - starts[i];
    memcpy(s->size, sizes + 4 * i, sizeof s->size);
    memcpy(s->local, locals + 12 * i, sizeof s->local);
    memcpy(s->world, s->local, sizeof s->world);
    enclose(w, s);
    turn(s->world, s->middle, s->center);
    for (int j = 0; j < 3; j++) s->center[j] += s->world[9 + j];
  }
  for (int i = 0; i < pairs; i++)
    w->pair[i].first = members[2 * i], w->pair[i].second = members[2 * i + 1];
  return w;
}

/* Write lower bounds of all distances: exact ones below `within`. */
void world_least(World *w, const double *q, double within, double *out) {
  place(w, q);
  for (int i = 0; i < w->pairs; i++) out[i] = distance(w, i, within);
}

/* The first pair whose distance is below what is required, -1 for none. */
int world_state(World *w, const double *q, double required) {
  place(w, q);
  for (int i = 0; i < w->pairs; i++) {
    if (distance(w, i, required) < required) return i;
  }
  return -1;
}

/* Sort pairs in doubt at a place into the arena; -1 where one is too near, -2 without memory.
   `left` has the distances of those that stay in doubt. */
static int doubtful(World *w, const Part *part, const double *required, const double *motions,
                    double share, int *first) {
  int kept = *first;
  if (kept + part->count > w->arena_room) {
    int room = 2 * (kept + part->count);
    int *more = realloc(w->arena, sizeof(int) * room);
    if (!more) return -2;
    w->arena = more, w->arena_room = room;
  }
  for (int i = 0; i < part->count; i++) {
    int pair = part->first < 0 ? i : w->arena[part->first + i];
    double moved = share * motions[pair], need = fmax(moved, required[pair]);
    double apart = distance(w, pair, fmin(need, fmax(required[pair], FAR + 0.25 * need)));
    if (apart < required[pair]) {
      w->hit = pair;
      return -1;
    }
    if (moved > apart && moved > MIN_MARGIN) w->left[pair] = apart, w->arena[kept++] = pair;
  }
  return kept - *first;
}

static int push(World *w, int *count, Part part) {
  if (*count == w->part_room) {
    Part *more = realloc(w->parts, sizeof *more * 2 * w->part_room);
    if (!more) return 0;
    w->parts = more, w->part_room *= 2;
  }
  w->parts[(*count)++] = part;
  return 1;
}

/* Whether a straight motion keeps what is required: 1, 0 with the share of the way, -1. */
int world_edge(World *w, const double *begin, const double *end, const double *required,
               double *where) {
  int queued = 0, room = 0;
  for (int j = 0; j < w->joints; j++) w->way[j] = end[j] - begin[j];
  for (int i = 0; i < w->pairs; i++) {
    double sum = 0.0;
    for (int j = 0; j < w->joints; j++) sum += w->rates[i * w->joints + j] * fabs(w->way[j]);
    w->motions[i] = sum;
  }
  if (w->hit >= 0 && w->hit < w->pairs) { /* what was in the way last is often again */
    place(w, end);
    if (distance(w, w->hit, required[w->hit]) < required[w->hit]) return *where = 1.0, 0;
  }
  if (!push(w, &queued, (Part){0.5, 0.5, -1, w->pairs})) return -1;
  for (int next = 0; next < queued; next++) {
    Part part = w->parts[next];
    int first = room, kept;
    double proved = HUGE, rest;
    for (int j = 0; j < w->joints; j++) w->state[j] = begin[j] + part.middle * w->way[j];
    place(w, w->state);
    kept = doubtful(w, &part, required, w->motions, part.half, &first);
    if (kept == -1) return *where = part.middle, 0;
    if (kept < 0) return -1;
    if (!kept) continue;
    room = first + kept;
    for (int i = first; i < room; i++)
      proved = fmin(proved, w->left[w->arena[i]] / w->motions[w->arena[i]]);
    rest = 0.5 * (part.half - fmax(proved, 0.0));
    if (!push(w, &queued, (Part){part.middle - part.half + rest, rest, first, kept}) ||
        !push(w, &queued, (Part){part.middle + part.half - rest, rest, first, kept}))
      return -1;
  }
  return 1;
}

/* Interpolate rows (count, width) of rising keys at one place. */
static void interpolated(const double *keys, const double *rows, int count, int width, double at,
                         double *out) {
  int low = 0, high = count - 1;
  double share, span;
  while (high - low > 1) {
    int half = (low + high) / 2;
    if (keys[half] <= at) low = half; else high = half;
  }
  span = keys[high] - keys[low];
  share = span > 0.0 ? fmin(fmax((at - keys[low]) / span, 0.0), 1.0) : 0.0;
  for (int j = 0; j < width; j++)
    out[j] = rows[low * width + j] + share * (rows[high * width + j] - rows[low * width + j]);
}

/* Whether a path of polynomials keeps what is required: 1, 0 with the time, -1.

   along: greatest motion of any shape until each time that cuts the path into cells (cells);
   turned: how far the joints turned until then (cells, joints). */
int world_path(World *w, int segments, const double *starts, const double *coefficients,
               int cells, const double *times, const double *along, const double *turned,
               double first_part, const double *required, double *where) {
  int queued = 0, room = 0, count, n = w->joints;
  double whole = along[cells - 1];
  double *before = w->turns + n, *middle = w->turns + 2 * n, *after = w->turns + 3 * n;
  count = (int)fmax(ceil(whole / first_part), 1.0);
  for (int i = 0; i < count; i++) {
    double half = 0.5 * whole / count;
    if (!push(w, &queued, (Part){(2 * i + 1) * half, half, -1, w->pairs})) return -1;
  }
  for (int next = 0; next < queued; next++) {
    Part part = w->parts[next];
    double when, late, proved = HUGE, rest;
    int first = room, kept, segment = 0;
    interpolated(along, times, cells, 1, part.middle, &when);
    interpolated(along, turned, cells, n, part.middle - part.half, before);
    interpolated(along, turned, cells, n, part.middle, middle);
    interpolated(along, turned, cells, n, part.middle + part.half, after);
    for (int j = 0; j < n; j++) w->turns[j] = fmax(middle[j] - before[j], after[j] - middle[j]);
    while (segment + 1 < segments && starts[segment + 1] <= when) segment++;
    late = when - starts[segment];
    for (int j = 0; j < n; j++) {
      const double *c = coefficients + (size_t)segment * 6 * n + j;
      w->state[j] = c[0] + late * (c[n] + late * (c[2 * n] + late * (c[3 * n] + late *
                    (c[4 * n] + late * c[5 * n]))));
    }
    place(w, w->state);
    for (int i = 0; i < part.count; i++) {
      int pair = part.first < 0 ? i : w->arena[part.first + i];
      double sum = 0.0;
      for (int j = 0; j < n; j++) sum += w->rates[pair * n + j] * w->turns[j];
      w->motions[pair] = sum;
    }
    kept = doubtful(w, &part, required, w->motions, 1.0, &first);
    if (kept == -1) return *where = when, 0;
    if (kept < 0) return -1;
    if (!kept) continue;
    room = first + kept;
    for (int i = first; i < room; i++) proved = fmin(proved, w->left[w->arena[i]]);
    rest = 0.5 * (part.half - fmax(proved, 0.0));
    if (rest <= 0.0) continue;
    if (!push(w, &queued, (Part){part.middle - part.half + rest, rest, first, kept}) ||
        !push(w, &queued, (Part){part.middle + part.half - rest, rest, first, kept}))
      return -1;
  }
  return 1;
}

/* A tree of RRT-Connect: states, and the node from which each was reached. */
typedef struct {
  int count, room;
  double *states;
  int *parents;
} Tree;

typedef struct {
  World *world;
  double *required, *end;
  double extension; /* greatest length of an edge */
  Tree trees[2];    /* from the start, from the goals */
  int growing, ends[2];
} Search;

static int tree_add(Tree *t, int n, const double *state, int parent) {
  if (t->count == t->room) {
    int room = t->room ? 2 * t->room : 256;
    double *states = realloc(t->states, sizeof(double) * n * room);
    int *parents;
    if (!states) return -1;
    t->states = states;
    parents = realloc(t->parents, sizeof(int) * room);
    if (!parents) return -1;
    t->parents = parents, t->room = room;
  }
  memcpy(t->states + (size_t)n * t->count, state, sizeof(double) * n);
  t->parents[t->count] = parent;
  return t->count++;
}

void search_free(Search *s) {
  if (!s) return;
  for (int i = 0; i < 2; i++) free(s->trees[i].states), free(s->trees[i].parents);
  free(s->required), free(s->end), free(s);
}

Search *search_new(World *w, const double *start, const double *required, double extension) {
  Search *s = calloc(1, sizeof *s);
  if (!s) return NULL;
  s->world = w, s->extension = extension;
  s->required = doubles(w->pairs), s->end = doubles(w->joints);
  if (!s->required || !s->end || tree_add(&s->trees[0], w->joints, start, -1) < 0) {
    search_free(s);
    return NULL;
  }
  memcpy(s->required, required, sizeof(double) * w->pairs);
  return s;
}

int search_add_goal(Search *s, const double *goal) {
  return tree_add(&s->trees[1], s->world->joints, goal, -1);
}

/* Grow a tree by an edge towards a target: the node at its end, -1 where it is blocked, -2. */
static int extend(Search *s, Tree *t, const double *target) {
  int n = s->world->joints, near = 0, free_way, node;
  double best = HUGE, length, where;
  const double *begin;
  for (int i = 0; i < t->count; i++) {
    double sum = 0.0;
    for (int j = 0; j < n; j++) {
      double apart = t->states[(size_t)i * n + j] - target[j];
      sum += apart * apart;
    }
    if (sum < best) best = sum, near = i;
  }
  length = sqrt(best);
  if (length < SAME) return near;
  begin = t->states + (size_t)near * n;
  for (int j = 0; j < n; j++) {
    s->end[j] = length <= s->extension ? target[j]
                                       : begin[j] + (target[j] - begin[j]) * (s->extension / length);
  }
  free_way = world_edge(s->world, begin, s->end, s->required, &where);
  if (free_way < 0) return -2;
  if (!free_way) return -1;
  node = tree_add(t, n, s->end, near);
  return node < 0 ? -2 : node;
}

static int branch_length(const Tree *t, int node) {
  int count = 0;
  for (; node >= 0; node = t->parents[node]) count++;
  return count;
}

/* Grow the trees towards targets: places of a path where they met, 0 where not, -1. */
int search_grow(Search *s, const double *targets, int count) {
  int n = s->world->joints;
  for (int i = 0; i < count; i++) {
    Tree *tree, *other;
    int reached, met;
    if (s->trees[s->growing].count > s->trees[1 - s->growing].count) s->growing = 1 - s->growing;
    tree = s->trees + s->growing, other = s->trees + 1 - s->growing;
    reached = extend(s, tree, targets + (size_t)i * n);
    if (reached == -2) return -1;
    if (reached < 0) continue;
    for (;;) {
      double apart = 0.0;
      met = extend(s, other, tree->states + (size_t)reached * n);
      if (met < 0) break;
      for (int j = 0; j < n; j++)
        apart = fmax(apart, fabs(other->states[(size_t)met * n + j] -
                                 tree->states[(size_t)reached * n + j]));
      if (apart < SAME) break;
    }
    if (met == -2) return -1;
    if (met >= 0) {
      s->ends[s->growing] = reached, s->ends[1 - s->growing] = met;
      return branch_length(s->trees, s->ends[0]) + branch_length(s->trees + 1, s->ends[1]) - 1;
    }
    s->growing = 1 - s->growing;
  }
  return 0;
}

/* Write the places of the path on which the trees met. */
void search_path(const Search *s, double *out) {
  int n = s->world->joints, row = branch_length(s->trees, s->ends[0]) - 1;
  for (int node = s->ends[0], at = row; node >= 0; node = s->trees[0].parents[node], at--)
    memcpy(out + (size_t)at * n, s->trees[0].states + (size_t)node * n, sizeof(double) * n);
  for (int node = s->trees[1].parents[s->ends[1]]; node >= 0; node = s->trees[1].parents[node])
    memcpy(out + (size_t)++row * n, s->trees[1].states + (size_t)node * n, sizeof(double) * n);
}
