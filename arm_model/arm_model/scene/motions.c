/* SPDX-FileCopyrightText: 2026 The arm and quad developers */
/* SPDX-License-Identifier: Apache-2.0 */

/* Whether motions of a scene are free: bounds of distances, edges, paths and RRT-Connect.

   A distance here is a lower bound that is its own proof: for any unit vector n, the gap between
   min n.b of one shape and max n.a of the other. GJK only chooses n, so nothing depends on its
   convergence: "free" is certain, "not free" may be cautious where it did not converge.

   What stands still is in a tree of boxes: a moving shape is compared with a node, and with what is
   below it only where the node is too near to prove anything.

   Conventions: lengths in [m], angles in [rad]. A placement is 12 numbers, the rotation by rows and
   the origin. One world belongs to one thread. Functions that can fail for want of memory return
   -1 or a null pointer. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BOX, POINT, SEGMENT, CYLINDER, CONE, HULL, HALF_SPACE, CELLS };
enum { MAX_GJK = 64, LEAF = 4, MAX_STACK = 256 }; /* LEAF: shapes below a node at most */

#define CONVERGED 1e-5      /* gap between bounds of a distance that ends GJK [m] */
#define CONVERGED_NEAR 1e-8 /* the same where shapes nearly touch [m] */
#define NEAR 3e-3           /* what counts as nearly [m] */
#ifndef LOOSE
#define LOOSE 0.5           /* share of a distance by which a bound that will do may be lower */
#endif
#undef HUGE
#define HUGE 1e300          /* more than any length */
#define NONE -HUGE          /* stands for no distance that is to be kept */
#define OVERLAP -1.0        /* what stands for the distance of shapes that overlap [m] */
#define MIN_MARGIN 1e-4     /* motion within a part that is not cut any further [m] */
#define FAR 0.01            /* a bound that will do, though it proves less of the motion [m] */
#ifndef COARSE
#define COARSE 0.125        /* half length of a node that is opened, by the motion in doubt */
#endif
#define SAME 1e-9           /* distance of states that are one [rad] */

typedef struct {
  int kind, joint;           /* joint: column that moves it, -1 for none */
  int first, count;          /* points of a hull */
  double size[4];            /* half lengths, or radius and half length, or plane */
  double swept;              /* how far the shape reaches beyond what the above describes */
  double local[12], world[12];
  double middle[3], radius;  /* sphere that holds it, in its own frame */
  double half[3];            /* half lengths of a box about that, without what is swept */
  double center[3], span[3]; /* box along the axes of the root link that holds it */
  int owner, mover;          /* number that its pairs know it by, and among what moves or -1 */
} Shape;

/* A box along the axes of the root link that holds shapes which stand still. */
typedef struct {
  double center[3], span[3];
  int first, count; /* of those shapes, in `still` */
  int below;        /* first of two nodes that share them, 0 for none */
} Node;

/* What may come near: a pair (mover < 0), or a moving shape and a node, or the one after all
   nodes and what stands still. */
typedef struct {
  int mover, which;
} Item;

typedef struct {
  int first, second;
  double direction[3]; /* last one that parted them, in the frame of the first */
} Pair;

typedef struct {
  double middle, half;
  int first, count; /* of the items in doubt, in the arena; first < 0 for the roots */
} Part;

typedef struct {
  int joints, columns, shapes, owners, pairs, points, movers, nodes, roots;
  double *factors, *offsets, *placements, *axes, *poses;
  int *parents, *slides;
  Shape *shape;
  Pair *pair;
  double *x, *y, *z, *dots; /* points of hulls, by coordinate */
  double *rates;            /* how fast each joint changes a pair's distance at most */
  double *fastest;          /* the same of all pairs of a mover with what stands still */
  double *state, *way, *turns; /* turns: four rows */
  int *moving, *still, *pair_of; /* shapes; pair of a mover and an owner that stands still, or -1 */
  Node *node;
  Item *root;
  Part *parts;
  int part_room;
  Item *arena;
  int arena_room;
  Item hit; /* what was found too near last */
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

/* A lower bound of the distance of two boxes along the same axes; -HUGE where they overlap. */
static double between_boxes(const double *center, const double *span, const double *other,
                            const double *its_span) {
  double sum = 0.0;
  for (int i = 0; i < 3; i++) {
    double gap = fabs(center[i] - other[i]) - span[i] - its_span[i];
    if (gap > 0.0) sum += gap * gap;
  }
  return sum > 0.0 ? sqrt(sum) : -HUGE;
}

/* A lower bound of the distance of the boxes about two shapes, by the gap along their axes. */
static double between_turned(const Shape *a, const Shape *b, const double *b_in_a) {
  double apart[3], back[3], most = -HUGE;
  turn(b_in_a, b->middle, apart);
  for (int i = 0; i < 3; i++) apart[i] += b_in_a[9 + i] - a->middle[i];
  turn_back(b_in_a, apart, back);
  for (int i = 0; i < 3; i++) {
    const double *row = b_in_a + 3 * i;
    double gap = fabs(apart[i]) - a->half[i] - fabs(row[0]) * b->half[0] -
                 fabs(row[1]) * b->half[1] - fabs(row[2]) * b->half[2];
    double its = fabs(back[i]) - b->half[i] - fabs(b_in_a[i]) * a->half[0] -
                 fabs(b_in_a[3 + i]) * a->half[1] - fabs(b_in_a[6 + i]) * a->half[2];
    most = fmax(most, fmax(gap, its));
  }
  return most;
}

/* A lower bound of the distance of two shapes: at least `enough`, below `keep` where the distance
   is, else exact but for LOOSE of it, or for CONVERGED where keep is NONE.
   direction: the last one that parted them, in the frame of the first. */
static double between(World *w, const Shape *a, const Shape *b, double *direction, double enough,
                      double keep) {
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
  least = fmax(least, between_boxes(a->center, a->span, b->center, b->span));
  if (least >= enough) return least;
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) {
      b_in_a[3 * i + j] = a->world[i] * b->world[j] + a->world[3 + i] * b->world[3 + j] +
                          a->world[6 + i] * b->world[6 + j];
    }
  }
  minus(b->world + 9, a->world + 9, apart);
  turn_back(a->world, apart, b_in_a + 9);
  least = fmax(least, between_turned(a, b, b_in_a) - swept);
  if (least >= enough) return least;
  memcpy(v, direction, sizeof v);
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
      memcpy(direction, d, sizeof d);
      if (least >= enough) return least;
    }
    if (count && (most < keep ||
                  most - least <= (keep > NONE && least >= keep && least >= NEAR ? LOOSE * most
                                   : least < NEAR ? CONVERGED_NEAR : CONVERGED)))
      return least;
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

/* Put a shape where its joint has it. */
static void put(Shape *s) {
  turn(s->world, s->middle, s->center);
  for (int i = 0; i < 3; i++) {
    const double *row = s->world + 3 * i;
    s->center[i] += s->world[9 + i];
    s->span[i] = fabs(row[0]) * s->half[0] + fabs(row[1]) * s->half[1] +
                 fabs(row[2]) * s->half[2] + s->swept;
  }
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
  for (int i = 0; i < w->movers; i++) {
    Shape *s = w->shape + w->moving[i];
    compose(w->poses + 12 * s->joint, s->local, s->world);
    put(s);
  }
}

static double *doubles(int count) { return calloc(count > 0 ? count : 1, sizeof(double)); }
static int *ints(int count) { return calloc(count > 0 ? count : 1, sizeof(int)); }

void world_free(World *w) {
  if (!w) return;
  free(w->factors), free(w->offsets), free(w->placements), free(w->axes), free(w->poses);
  free(w->parents), free(w->slides), free(w->shape), free(w->pair), free(w->x), free(w->y);
  free(w->z), free(w->dots), free(w->rates), free(w->fastest), free(w->state), free(w->way);
  free(w->turns), free(w->moving), free(w->still), free(w->pair_of), free(w->node);
  free(w->root), free(w->parts), free(w->arena), free(w);
}

/* Fill in the sphere and the box that hold a shape, the sphere with what is swept. */
static void enclose(const World *w, Shape *s) {
  double low[3], high[3];
  const double *size = s->size;
  s->radius = 0.0;
  switch (s->kind) {
    case BOX:
      memcpy(s->half, size, sizeof s->half);
      s->radius = sqrt(dot(size, size));
      break;
    case SEGMENT: s->radius = s->half[2] = size[1]; break;
    case CYLINDER:
    case CONE:
      s->half[0] = s->half[1] = size[0], s->half[2] = size[1];
      s->radius = hypot(size[0], size[1]);
      break;
    case HULL:
      for (int j = 0; j < 3; j++) {
        const double *axis = j == 0 ? w->x : j == 1 ? w->y : w->z;
        low[j] = HUGE, high[j] = -HUGE;
        for (int i = s->first; i < s->first + s->count; i++)
          low[j] = fmin(low[j], axis[i]), high[j] = fmax(high[j], axis[i]);
        s->middle[j] = 0.5 * (low[j] + high[j]), s->half[j] = 0.5 * (high[j] - low[j]);
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

/* Order shapes so that the one at a place has none above it before it, along an axis. */
static void select_place(const World *w, int *these, int count, int place, int axis) {
  int low = 0, high = count - 1;
  while (low < high) {
    double pivot = w->shape[these[(low + high) / 2]].center[axis];
    int i = low, j = high;
    while (i <= j) {
      while (w->shape[these[i]].center[axis] < pivot) i++;
      while (w->shape[these[j]].center[axis] > pivot) j--;
      if (i <= j) {
        int other = these[i];
        these[i++] = these[j], these[j--] = other;
      }
    }
    if (place <= j) high = j;
    else if (place >= i) low = i;
    else return;
  }
}

/* Make a node of shapes that stand still, and those below it. */
static void make_node(World *w, int number, int first, int count) {
  Node *node = w->node + number;
  int axis = 0, *these = w->still + first, below;
  double low[3] = {HUGE, HUGE, HUGE}, high[3] = {-HUGE, -HUGE, -HUGE};
  for (int i = 0; i < count; i++) {
    const Shape *s = w->shape + these[i];
    for (int j = 0; j < 3; j++) {
      low[j] = fmin(low[j], s->center[j] - s->span[j]);
      high[j] = fmax(high[j], s->center[j] + s->span[j]);
    }
  }
  for (int j = 0; j < 3; j++) {
    node->center[j] = 0.5 * (low[j] + high[j]), node->span[j] = 0.5 * (high[j] - low[j]);
    if (node->span[j] > node->span[axis]) axis = j;
  }
  node->first = first, node->count = count, node->below = 0;
  if (count <= LEAF) return;
  node->below = below = w->nodes, w->nodes += 2;
  select_place(w, these, count, count / 2, axis);
  make_node(w, below, first, count / 2);
  make_node(w, below + 1, first + count / 2, count - count / 2);
}

/* Sort the pairs: those of what moves and what stands still go by the tree. -1 without memory. */
static int plant(World *w) {
  int owners = w->owners, n = w->joints, stills = 0, with_tree = 0;
  for (int i = 0; i < w->shapes; i++) {
    if (w->shape[i].joint >= 0) w->shape[i].mover = w->movers, w->moving[w->movers++] = i;
  }
  w->pair_of = ints(w->movers * owners), w->fastest = doubles(w->movers * n);
  w->root = calloc(w->pairs + w->movers + 1, sizeof *w->root);
  if (!w->pair_of || !w->fastest || !w->root) return -1;
  for (int i = 0; i < w->movers * owners; i++) w->pair_of[i] = -1;
  for (int i = 0; i < w->pairs; i++) {
    const Shape *a = w->shape + w->pair[i].first, *b = w->shape + w->pair[i].second;
    const Shape *mover = a->mover >= 0 ? a : b, *other = mover == a ? b : a;
    if (other->mover >= 0 || mover->kind == HALF_SPACE || other->kind == HALF_SPACE) {
      w->root[w->roots++] = (Item){-1, i};
      continue;
    }
    w->pair_of[mover->mover * owners + other->owner] = i;
    for (int j = 0; j < n; j++) {
      double *most = w->fastest + mover->mover * n + j;
      *most = fmax(*most, w->rates[i * n + j]);
    }
  }
  for (int i = 0; i < w->shapes; i++) {
    const Shape *s = w->shape + i;
    int paired = 0;
    if (s->mover >= 0 || s->kind == HALF_SPACE || s->kind == CELLS) continue;
    for (int m = 0; m < w->movers && !paired; m++) paired = w->pair_of[m * owners + s->owner] >= 0;
    if (paired) w->still[stills++] = i;
  }
  w->node = calloc(2 * stills + 2, sizeof *w->node);
  if (!w->node) return -1;
  if (!stills) return 0;
  w->nodes = 1;
  make_node(w, 0, 0, stills);
  for (int m = 0; m < w->movers; m++) {
    with_tree = 0;
    for (int i = 0; i < owners && !with_tree; i++) with_tree = w->pair_of[m * owners + i] >= 0;
    if (with_tree) w->root[w->roots++] = (Item){m, 0};
  }
  return 0;
}

/* Make a world. owners: number of the shape that a cell is part of, of others their own; pairs
   are of the first `known` shapes. */
World *world_new(int joints, int columns, int shapes, int known, int pairs, int points,
                 const double *factors, const double *offsets, const int *parents,
                 const int *slides, const double *placements, const double *axes,
                 const int *kinds, const int *movers, const double *locals, const double *sizes,
                 const double *swept, const int *owners, const int *starts,
                 const double *corners, const int *members, const double *rates) {
  World *w = calloc(1, sizeof *w);
  if (!w) return NULL;
  w->joints = joints, w->columns = columns, w->shapes = shapes, w->pairs = pairs;
  w->points = points, w->owners = known, w->hit = (Item){-1, -1};
  w->factors = doubles(columns * joints), w->offsets = doubles(columns);
  w->placements = doubles(12 * columns), w->axes = doubles(3 * columns);
  w->poses = doubles(12 * columns), w->parents = ints(columns), w->slides = ints(columns);
  w->shape = calloc(shapes + 1, sizeof *w->shape), w->pair = calloc(pairs + 1, sizeof *w->pair);
  w->x = doubles(points), w->y = doubles(points), w->z = doubles(points);
  w->dots = doubles(points), w->rates = doubles(pairs * joints), w->state = doubles(joints);
  w->way = doubles(joints), w->turns = doubles(4 * joints), w->moving = ints(shapes);
  w->still = ints(shapes), w->part_room = 64, w->arena_room = 1024;
  w->parts = calloc(w->part_room, sizeof *w->parts);
  w->arena = calloc(w->arena_room, sizeof *w->arena);
  if (!(w->factors && w->offsets && w->placements && w->axes && w->poses && w->parents &&
        w->slides && w->shape && w->pair && w->x && w->y && w->z && w->dots && w->rates &&
        w->state && w->way && w->turns && w->moving && w->still && w->parts && w->arena)) {
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
    s->owner = owners[i], s->mover = -1;
    s->first = starts[i], s->count = starts[i + 1] - starts[i];
    memcpy(s->size, sizes + 4 * i, sizeof s->size);
    memcpy(s->local, locals + 12 * i, sizeof s->local);
    memcpy(s->world, s->local, sizeof s->world);
    enclose(w, s);
    put(s);
  }
  for (int i = 0; i < pairs; i++)
    w->pair[i].first = members[2 * i], w->pair[i].second = members[2 * i + 1];
  if (plant(w) < 0) {
    world_free(w);
    return NULL;
  }
  return w;
}

/* The pair to which an item belongs; -1 where it is a node, or what is not checked. */
static int pair_of(const World *w, Item item) {
  if (item.mover < 0) return item.which;
  if (item.which < w->nodes) return -1;
  return w->pair_of[item.mover * w->owners + w->shape[w->still[item.which - w->nodes]].owner];
}

/* A lower bound of the distance of a pair, by the item that has its shapes. */
static double distance(World *w, Item item, int pair, double enough, double keep) {
  Pair *p = w->pair + pair;
  const Shape *a = w->shape + p->first, *b = w->shape + p->second;
  double none[3] = {0.0, 0.0, 0.0};
  if (item.mover >= 0)
    a = w->shape + w->moving[item.mover], b = w->shape + w->still[item.which - w->nodes];
  return between(w, a, b, b - w->shape < w->owners ? p->direction : none, enough, keep);
}

/* A lower bound of the distance of a moving shape from what is below a node. */
static double node_distance(const World *w, Item item) {
  const Shape *s = w->shape + w->moving[item.mover];
  const Node *node = w->node + item.which;
  static const double point[3] = {0.0, 0.0, 0.0};
  return fmax(between_boxes(s->center, s->span, node->center, node->span),
              between_boxes(s->center, point, node->center, node->span) - s->radius);
}

/* Whether a node is so large that what is below it may prove much more of a motion. */
static int is_coarse(const World *w, Item item, double motion) {
  const double *span = w->node[item.which].span;
  return fmax(fmax(span[0], span[1]), span[2]) > COARSE * motion;
}

/* Write what is right below a node, and return how many. */
static int open_node(const World *w, Item item, Item *out) {
  const Node *node = w->node + item.which;
  if (node->below) {
    out[0] = (Item){item.mover, node->below}, out[1] = (Item){item.mover, node->below + 1};
    return 2;
  }
  for (int i = 0; i < node->count; i++) out[i] = (Item){item.mover, w->nodes + node->first + i};
  return node->count;
}

/* Look at all pairs: write lower bounds of their distances, exact ones below `within`; without
   `out` return the first pair whose distance is below that, -1 for none. */
static int look(World *w, const double *q, double within, double *out) {
  place(w, q);
  for (int i = 0; out && i < w->pairs; i++) out[i] = within;
  for (int i = 0; i < w->roots; i++) {
    Item stack[MAX_STACK] = {w->root[i]};
    for (int count = 1; count > 0;) {
      Item item = stack[--count];
      int pair = pair_of(w, item);
      double apart;
      if (item.mover >= 0 && item.which < w->nodes) {
        if (node_distance(w, item) < within) count += open_node(w, item, stack + count);
        continue;
      }
      if (pair < 0) continue;
      apart = distance(w, item, pair, within, out ? NONE : within);
      if (out) out[pair] = item.mover < 0 ? apart : fmin(out[pair], apart);
      else if (apart < within) return pair;
    }
  }
  return -1;
}

/* Write lower bounds of all distances: exact ones below `within`. */
void world_least(World *w, const double *q, double within, double *out) {
  look(w, q, within, out);
}

/* A pair whose distance is below what is required, -1 for none. */
int world_state(World *w, const double *q, double required) {
  return look(w, q, required, NULL);
}

/* How far shapes move at most, by how fast each joint does it and how far it turns. */
static double moved_by(const double *rates, const double *turned, int n) {
  double sum = 0.0;
  for (int j = 0; j < n; j++) sum += rates[j] * turned[j];
  return sum;
}

static double greatest(const double *values, int count) {
  double most = -HUGE;
  for (int i = 0; i < count; i++) most = values[i] > most ? values[i] : most;
  return most;
}

/* Sort items in doubt at a place into the arena; -1 where one is too near, -2 without memory.

   turned, share: how far the joints turn within the part, but for a factor; most: the greatest of
   what is required; proved: least distance of what stays in doubt, or least share of its motion. */
static int doubtful(World *w, const Part *part, const double *required, double most,
                    const double *turned, double share, int of_motion, int first,
                    double *proved) {
  int kept = first, n = w->joints;
  *proved = HUGE;
  for (int i = 0; i < part->count; i++) {
    Item stack[MAX_STACK] = {part->first < 0 ? w->root[i] : w->arena[part->first + i]};
    for (int count = 1; count > 0;) {
      Item item = stack[--count];
      int pair = pair_of(w, item), is_node = item.mover >= 0 && item.which < w->nodes;
      double moved, need, will_do, apart, keep;
      if (pair < 0 && !is_node) continue;
      keep = is_node ? most : required[pair];
      moved = moved_by(is_node ? w->fastest + item.mover * n : w->rates + (size_t)pair * n,
                       turned, n);
      need = fmax(share * moved, keep);
      will_do = fmin(need, fmax(keep, FAR));
      apart = is_node ? node_distance(w, item) : distance(w, item, pair, will_do, keep);
      if (is_node && apart < will_do && (apart < keep || is_coarse(w, item, need))) {
        count += open_node(w, item, stack + count);
        continue;
      }
      if (apart < keep) {
        w->hit = item;
        return -1;
      }
      if (share * moved <= apart || share * moved <= MIN_MARGIN) continue;
      *proved = fmin(*proved, of_motion ? apart / moved : apart);
      if (kept == w->arena_room) {
        Item *more = realloc(w->arena, sizeof *more * 2 * w->arena_room);
        if (!more) return -2;
        w->arena = more, w->arena_room *= 2;
      }
      w->arena[kept++] = item;
    }
  }
  return kept - first;
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
  int queued = 0, room = 0, hit = w->hit.which < 0 ? -1 : pair_of(w, w->hit);
  double most = greatest(required, w->pairs);
  for (int j = 0; j < w->joints; j++)
    w->way[j] = end[j] - begin[j], w->turns[j] = fabs(w->way[j]);
  if (hit >= 0) { /* what was in the way last is often again */
    place(w, end);
    double keep = required[hit];
    if (distance(w, w->hit, hit, keep, keep) < keep) return *where = 1.0, 0;
  }
  if (!push(w, &queued, (Part){0.5, 0.5, -1, w->roots})) return -1;
  for (int next = 0; next < queued; next++) {
    Part part = w->parts[next];
    int first = room, kept;
    double proved, rest;
    for (int j = 0; j < w->joints; j++) w->state[j] = begin[j] + part.middle * w->way[j];
    place(w, w->state);
    kept = doubtful(w, &part, required, most, w->turns, part.half, 1, first, &proved);
    if (kept == -1) return *where = part.middle, 0;
    if (kept < 0) return -1;
    if (!kept) continue;
    room = first + kept;
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
  double whole = along[cells - 1], most = greatest(required, w->pairs);
  double *before = w->turns + n, *middle = w->turns + 2 * n, *after = w->turns + 3 * n;
  count = (int)fmax(ceil(whole / first_part), 1.0);
  for (int i = 0; i < count; i++) {
    double half = 0.5 * whole / count;
    if (!push(w, &queued, (Part){(2 * i + 1) * half, half, -1, w->roots})) return -1;
  }
  for (int next = 0; next < queued; next++) {
    Part part = w->parts[next];
    double when, late, proved, rest;
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
    kept = doubtful(w, &part, required, most, w->turns, 1.0, 0, first, &proved);
    if (kept == -1) return *where = when, 0;
    if (kept < 0) return -1;
    if (!kept) continue;
    room = first + kept;
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
