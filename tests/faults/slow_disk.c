// Before the C library, in a process whose disk is to be slow: each flush takes SLOW_DISK_S seconds while the file SLOW_DISK is there.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

static int flush(const char *name, int file) {
  int (*flushed)(int) = (int (*)(int))dlsym(RTLD_NEXT, name);
  const char *slow = getenv("SLOW_DISK");
  if (slow && access(slow, F_OK) == 0) {
    double seconds = atof(getenv("SLOW_DISK_S"));
    struct timespec rest = {(time_t)seconds, (long)(1e9 * (seconds - (time_t)seconds))};
    while (nanosleep(&rest, &rest)) {
    }
  }
  return flushed(file);
}

int fsync(int file) { return flush("fsync", file); }
int fdatasync(int file) { return flush("fdatasync", file); }
