/* Copyright 2026 satform contributors
 * SPDX-License-Identifier: Apache-2.0
 *
 * Calls of the file system that fail when they are told to, for a process that is started with LD_PRELOAD.
 *
 * Calls on paths below a prefix are counted by kind. The call of a kind and number that was armed fails with an
 * error, writes only a part of its data, kills the process, or sets the wall clock ahead or back.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

enum kind { OPEN, WRITE, SYNC, RENAME, MKDIR, UNLINK, KINDS };
enum { SHORT = -1, KILL = -2, DAY_AHEAD = -3, DAY_BACK = -4 };

#define DAY 86400

static char prefix[4096];
static long counts[KINDS];
static int armed_kind = -1, armed_effect;
static long armed_number;
static long clock_offset;

void failing_watch(const char *path) {
  snprintf(prefix, sizeof prefix, "%s", path);
  memset(counts, 0, sizeof counts);
  armed_kind = -1;
}

void failing_arm(int kind, long number, int effect) {
  armed_kind = kind;
  armed_number = number;
  armed_effect = effect;
}

long failing_count(int kind) { return counts[kind]; }

/* What becomes of a call: 0 nothing, an error number, or SHORT. */
static int effect(enum kind kind, const char *path) {
  if (!prefix[0] || !path || strncmp(path, prefix, strlen(prefix)))
    return 0;
  if (++counts[kind] != armed_number || (int)kind != armed_kind)
    return 0;
  if (armed_effect == KILL)
    kill(getpid(), SIGKILL);
  if (armed_effect == DAY_AHEAD || armed_effect == DAY_BACK) {
    clock_offset = armed_effect == DAY_AHEAD ? DAY : -DAY;
    return 0;
  }
  return armed_effect;
}

static const char *path_of(int folder, const char *name, char *path, size_t size) {
  char link[64];
  ssize_t length = 0;
  if (name && name[0] == '/')
    return name;
  if (folder == AT_FDCWD)
    snprintf(link, sizeof link, "/proc/self/cwd");
  else
    snprintf(link, sizeof link, "/proc/self/fd/%d", folder);
  length = readlink(link, path, size - 1);
  if (length < 0)
    return NULL;
  path[length] = 0;
  if (name)
    snprintf(path + length, size - length, "/%s", name);
  return path;
}

static int fails(enum kind kind, int folder, const char *name) {
  char path[8192];
  int error = prefix[0] ? effect(kind, path_of(folder, name, path, sizeof path)) : 0;
  if (error > 0)
    errno = error;
  return error;
}

#define REAL(name) \
  static __typeof__(name) *real; \
  if (!real) \
    real = (__typeof__(name) *)dlsym(RTLD_NEXT, #name)

#define MODE \
  mode_t mode = 0; \
  if (flags & (O_CREAT | O_TMPFILE)) { \
    va_list list; \
    va_start(list, flags); \
    mode = va_arg(list, mode_t); \
    va_end(list); \
  }

/* Only files that are opened to be written. */
static int open_fails(int folder, const char *name, int flags) {
  return (flags & O_ACCMODE) != O_RDONLY && fails(OPEN, folder, name) > 0;
}

int open(const char *name, int flags, ...) {
  REAL(open);
  MODE;
  return open_fails(AT_FDCWD, name, flags) ? -1 : real(name, flags, mode);
}

int open64(const char *name, int flags, ...) {
  REAL(open64);
  MODE;
  return open_fails(AT_FDCWD, name, flags) ? -1 : real(name, flags, mode);
}

int openat(int folder, const char *name, int flags, ...) {
  REAL(openat);
  MODE;
  return open_fails(folder, name, flags) ? -1 : real(folder, name, flags, mode);
}

int openat64(int folder, const char *name, int flags, ...) {
  REAL(openat64);
  MODE;
  return open_fails(folder, name, flags) ? -1 : real(folder, name, flags, mode);
}

ssize_t write(int file, const void *data, size_t size) {
  REAL(write);
  int error = fails(WRITE, file, NULL);
  if (error > 0)
    return -1;
  return real(file, data, error == SHORT && size > 1 ? size / 2 : size);
}

int fsync(int file) {
  REAL(fsync);
  return fails(SYNC, file, NULL) > 0 ? -1 : real(file);
}

int fdatasync(int file) {
  REAL(fdatasync);
  return fails(SYNC, file, NULL) > 0 ? -1 : real(file);
}

int rename(const char *from, const char *to) {
  REAL(rename);
  return fails(RENAME, AT_FDCWD, to) > 0 ? -1 : real(from, to);
}

int renameat(int of, const char *from, int in, const char *to) {
  REAL(renameat);
  return fails(RENAME, in, to) > 0 ? -1 : real(of, from, in, to);
}

int mkdir(const char *name, mode_t mode) {
  REAL(mkdir);
  return fails(MKDIR, AT_FDCWD, name) > 0 ? -1 : real(name, mode);
}

int unlink(const char *name) {
  REAL(unlink);
  return fails(UNLINK, AT_FDCWD, name) > 0 ? -1 : real(name);
}

int unlinkat(int folder, const char *name, int flags) {
  REAL(unlinkat);
  return fails(UNLINK, folder, name) > 0 ? -1 : real(folder, name, flags);
}

int clock_gettime(clockid_t clock, struct timespec *time) {
  REAL(clock_gettime);
  int result = real(clock, time);
  if (clock == CLOCK_REALTIME)
    time->tv_sec += clock_offset;
  return result;
}

int gettimeofday(struct timeval *restrict time, void *restrict zone) {
  REAL(gettimeofday);
  int result = real(time, zone);
  time->tv_sec += clock_offset;
  return result;
}

time_t time(time_t *now) {
  struct timespec found;
  clock_gettime(CLOCK_REALTIME, &found);
  if (now)
    *now = found.tv_sec;
  return found.tv_sec;
}
