/* SPDX-FileCopyrightText: 2026 The arm and quad developers */
/* SPDX-License-Identifier: Apache-2.0 */

/* Waits for the datagrams of a CAN socket, stamps and decodes them. socket_bus.py is the reference.

   Only data frames with an 11-bit identifier in the usual layout are decoded here; every other
   datagram is handed over as it came. Stamps are moved from the wall clock to the steady clock as
   WallClock and TimestampReader do. One reader belongs to one thread. */

#define _GNU_SOURCE
#include <errno.h>
#include <math.h>
#include <poll.h>
#include <stdint.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <netinet/in.h>
#include <arpa/inet.h>
#include <time.h>

enum { SLOTS = 64, DATAGRAM_MAX = 384, ANCILLARY_MAX = 128, PAYLOAD_MAX = 8, STANDARD_MAX = 0x7FF };
enum { FIRST_PDO = 0x181, LAST_PDO = 0x57F }; /* what comes between these may wait for others */
#define READ_AHEAD 1e-3 /* frames may arrive while a batch is read [s] */
#define GATHERING 15e-6 /* time in which frames that are missing gather, for each of them [s] */
#define SECONDS(time) (struct timespec){(time_t)(time), fmod(time, 1.0) * 1e9}
#define NANO 1000000000LL
#define SO_TIMESTAMPNS_OLD_KIND 35 /* asm-generic/socket.h */
#define SO_RXQ_OVFL_KIND 40

typedef struct {
  int64_t offset; /* wall clock minus steady clock [ns] */
  double last;    /* time of the last datagram [s] */
  int64_t lost;   /* datagrams that the kernel has dropped */
  uint32_t drops; /* the same as this socket counts them */
  int32_t error;  /* of the socket, which the frames that were read before it have put off */
  uint32_t own;   /* address that this bus sends from, whose echo is dropped; 0 for SocketCAN */
  uint16_t own_port;
  /* of a datagram of a multicast bus: sizes and bytes of what stands around identifier, length
     and payload; no size for SocketCAN, whose datagrams are struct can_frame */
  uint16_t head_size, flags_size, key_size, tail_size;
  uint8_t head[64], flags[96], key[16], tail[64];
} Reader;

typedef struct {
  double time;      /* of arrival on the steady clock [s] */
  uint32_t id;      /* identifier; the sender's address of a raw datagram */
  uint16_t size;    /* of the payload, or of the raw datagram [byte] */
  uint16_t raw;     /* 1 for a raw datagram, whose data is the sender's port; else 0 */
  uint8_t data[PAYLOAD_MAX];
} Record;

static int64_t clock_ns(clockid_t clock) {
  struct timespec now;
  clock_gettime(clock, &now);
  return now.tv_sec * NANO + now.tv_nsec;
}

/* Compare the clocks; return the steady time [ns]. */
static int64_t compare_clocks(Reader *reader) {
  int64_t before = clock_ns(CLOCK_MONOTONIC), wall = clock_ns(CLOCK_REALTIME);
  int64_t now = clock_ns(CLOCK_MONOTONIC);
  if (reader->offset > wall - before) reader->offset = wall - before;
  else if (reader->offset < wall - now) reader->offset = wall - now;
  return now;
}

static double arrival(Reader *reader, struct msghdr *message, double limit) {
  double stamp = 0.0;
  for (struct cmsghdr *each = CMSG_FIRSTHDR(message); each; each = CMSG_NXTHDR(message, each)) {
    if (each->cmsg_type == SO_TIMESTAMPNS_OLD_KIND) {
      struct timespec time;
      memcpy(&time, CMSG_DATA(each), sizeof time);
      stamp = (double)(time.tv_sec * NANO + time.tv_nsec - reader->offset) * 1e-9;
    } else if (each->cmsg_type == SO_RXQ_OVFL_KIND) {
      uint32_t drops;
      memcpy(&drops, CMSG_DATA(each), sizeof drops);
      reader->lost += (uint32_t)(drops - reader->drops);
      reader->drops = drops;
    }
  }
  if (stamp > limit || stamp == 0.0) {
    double now = (double)clock_ns(CLOCK_MONOTONIC) * 1e-9;
    if (stamp == 0.0 || now < stamp) stamp = now;
  }
  if (stamp > reader->last) reader->last = stamp;
  return reader->last;
}

static int same(const uint8_t **at, const uint8_t *bytes, int size) {
  const uint8_t *begin = *at;
  *at += size;
  return !memcmp(begin, bytes, size);
}

/* Decode a plain frame in python-can's msgpack layout; return whether it is one. */
static int decode_multicast(const Reader *r, const uint8_t *at, int size, Record *out) {
  const uint8_t *end = at + size;
  int fixed = r->head_size + r->flags_size + r->key_size + r->tail_size;
  if (size < fixed + 3 || !same(&at, r->head, r->head_size)) return 0;
  out->id = *at++;
  if (out->id == 0xCC) { /* one byte follows */
    out->id = *at++;
    if (out->id < 0x80) return 0;
  } else if (out->id == 0xCD) { /* two bytes */
    out->id = at[0] << 8 | at[1];
    at += 2;
    if (out->id < 0x100 || out->id > STANDARD_MAX) return 0;
  } else if (out->id >= 0x80) {
    return 0;
  }
  if (!same(&at, r->flags, r->flags_size)) return 0;
  out->size = *at++;
  if (out->size > PAYLOAD_MAX || !same(&at, r->key, r->key_size) || *at++ != out->size) return 0;
  if (end - at != out->size + r->tail_size) return 0;
  memcpy(out->data, at, out->size);
  at += out->size;
  return same(&at, r->tail, r->tail_size);
}

static int decode_can(const uint8_t *at, int size, Record *out) {
  if (size != 16) return 0;
  memcpy(&out->id, at, 4);
  out->size = at[4];
  memcpy(out->data, at + 8, PAYLOAD_MAX);
  return out->id <= STANDARD_MAX && out->size <= PAYLOAD_MAX;
}

/* Read what is there; return the number of records with those before, or an error below 0. */
static int drain(Reader *reader, int fd, int count, Record *records, uint8_t *raw, int *urgent) {
  static __thread uint8_t datagrams[SLOTS][DATAGRAM_MAX];
  static __thread _Alignas(struct cmsghdr) uint8_t ancillary[SLOTS][ANCILLARY_MAX];
  struct mmsghdr messages[SLOTS];
  struct iovec vectors[SLOTS];
  struct sockaddr_in sources[SLOTS];
  int room = SLOTS - count;
  for (int i = 0; i < room; i++) {
    vectors[i] = (struct iovec){datagrams[i], DATAGRAM_MAX};
    messages[i].msg_hdr = (struct msghdr){
        .msg_name = reader->head_size ? &sources[i] : 0,
        .msg_namelen = reader->head_size ? sizeof sources[i] : 0,
        .msg_iov = &vectors[i], .msg_iovlen = 1,
        .msg_control = ancillary[i], .msg_controllen = ANCILLARY_MAX};
  }
  int got = recvmmsg(fd, messages, room, MSG_DONTWAIT, 0);
  if (got < 0) {
    if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) return count;
    if (!count) return -errno;
    reader->error = errno;
    *urgent = 1;
    return count;
  }
  double limit = (double)compare_clocks(reader) * 1e-9 + READ_AHEAD;
  for (int i = 0; i < got; i++) {
    Record *out = &records[count];
    int size = messages[i].msg_len, plain;
    uint32_t address = 0;
    uint16_t port = 0;
    out->time = arrival(reader, &messages[i].msg_hdr, limit);
    if (reader->head_size) {
      address = ntohl(sources[i].sin_addr.s_addr), port = ntohs(sources[i].sin_port);
      if (address == reader->own && port == reader->own_port) continue;
      plain = address >> 24 == 127 && decode_multicast(reader, datagrams[i], size, out);
    } else {
      plain = decode_can(datagrams[i], size, out);
    }
    out->raw = !plain;
    if (!plain) {
      out->id = address, out->size = size;
      memcpy(out->data, &port, sizeof port);
      memcpy(raw + (size_t)count * DATAGRAM_MAX, datagrams[i], size);
    }
    if (!plain || out->id < FIRST_PDO || out->id > LAST_PDO) *urgent = 1;
    count++;
  }
  return count;
}

/* Wait at most so long [s] until so many frames of process data are there, or another one, or the
   event of wake_fd; return the number of records, with 0x10000 for the event, or an error below 0.
   Without a time to wait, it reads what is there. Where several are expected, it sleeps before it
   looks: waking up for each frame costs more than reading it. */
int reader_receive(Reader *reader, int fd, int wake_fd, double timeout, int expected,
                   Record *records, uint8_t *raw) {
  int count = 0, urgent = 0, error = reader->error;
  reader->error = 0;
  if (error) return -error;
  if (timeout <= 0.0) return drain(reader, fd, 0, records, raw, &urgent);
  double deadline = (double)clock_ns(CLOCK_MONOTONIC) * 1e-9 + timeout;
  if (expected > SLOTS) expected = SLOTS;
  for (;;) {
    double left = fmax(0.0, deadline - (double)clock_ns(CLOCK_MONOTONIC) * 1e-9);
    if (expected - count > 1) {
      double gathering = fmin(left, (expected - count) * GATHERING);
      clock_nanosleep(CLOCK_MONOTONIC, 0, &SECONDS(gathering), 0);
      int before = count;
      count = drain(reader, fd, count, records, raw, &urgent);
      if (count < 0 || urgent || count >= expected) return count;
      if (count > before) continue; /* the others are on their way */
      left = fmax(0.0, left - gathering);
    }
    struct pollfd both[] = {{fd, POLLIN, 0}, {wake_fd, POLLIN, 0}};
    int ready = ppoll(both, 2, isfinite(left) ? &SECONDS(left) : 0, 0);
    if (ready < 0) return errno == EINTR ? count : -errno;
    if (both[1].revents) {
      eventfd_t value;
      eventfd_read(wake_fd, &value);
      return count | 0x10000;
    }
    if (!ready) return count;
    count = drain(reader, fd, count, records, raw, &urgent);
    if (count < 0 || urgent || count >= expected) return count;
  }
}
