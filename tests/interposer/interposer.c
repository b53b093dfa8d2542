/* Preloaded into a process under test: calls of the C library that hang or fail on command.
 *
 * INTERPOSER_DIRECTORY: the calls on files in it are concerned.
 * INTERPOSER_ORDERS:    a directory whose files are the commands:
 *   hang-sync      waiting for the disk hangs for as long as the file is there
 *   hang           so does everything that changes a file or a directory, as on a frozen file system
 *   full           writes find no space left
 *   panic-THREAD   once, the thread of this name cannot tell the time, for which Rust's library panics
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#define NEXT(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

static int ordered(const char *what)
{
    const char *orders = getenv("INTERPOSER_ORDERS");
    char path[PATH_MAX];
    if (!orders)
        return 0;
    snprintf(path, sizeof path, "%s/%s", orders, what);
    int before = errno;
    int there = access(path, F_OK) == 0;
    errno = before;
    return there;
}

static int concerns_path(const char *path)
{
    const char *directory = getenv("INTERPOSER_DIRECTORY");
    return directory && strncmp(path, directory, strlen(directory)) == 0;
}

static int concerns(int fd)
{
    char link[64], path[PATH_MAX];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    int before = errno;
    ssize_t length = readlink(link, path, sizeof path - 1);
    errno = before;
    if (length < 0)
        return 0;
    path[length] = 0;
    return concerns_path(path);
}

static void hang_while(const char *what)
{
    const struct timespec moment = {0, 5 * 1000 * 1000};
    while (ordered(what))
        nanosleep(&moment, NULL);
}

static int no_space(void)
{
    if (!ordered("full"))
        return 0;
    errno = ENOSPC;
    return 1;
}

int fdatasync(int fd)
{
    if (concerns(fd)) {
        hang_while("hang-sync");
        hang_while("hang");
    }
    return NEXT(fdatasync)(fd);
}

int fsync(int fd)
{
    if (concerns(fd)) {
        hang_while("hang-sync");
        hang_while("hang");
    }
    return NEXT(fsync)(fd);
}

ssize_t write(int fd, const void *bytes, size_t count)
{
    if (concerns(fd)) {
        hang_while("hang");
        if (no_space())
            return -1;
    }
    return NEXT(write)(fd, bytes, count);
}

ssize_t pwrite64(int fd, const void *bytes, size_t count, off64_t offset)
{
    if (concerns(fd)) {
        hang_while("hang");
        if (no_space())
            return -1;
    }
    return NEXT(pwrite64)(fd, bytes, count, offset);
}

int ftruncate64(int fd, off64_t length)
{
    if (concerns(fd))
        hang_while("hang");
    return NEXT(ftruncate64)(fd, length);
}

int rename(const char *from, const char *to)
{
    if (concerns_path(to))
        hang_while("hang");
    return NEXT(rename)(from, to);
}

int open64(const char *path, int flags, ...)
{
    va_list rest;
    va_start(rest, flags);
    mode_t mode = va_arg(rest, mode_t);
    va_end(rest);
    if ((flags & O_ACCMODE) != O_RDONLY && concerns_path(path))
        hang_while("hang");
    return NEXT(open64)(path, flags, mode);
}

int clock_gettime(clockid_t clock, struct timespec *now)
{
    static __thread int obeyed;
    char order[32] = "panic-", *thread = order + strlen(order);
    prctl(PR_GET_NAME, thread);
    if (!obeyed && ordered(order)) {
        obeyed = 1;
        errno = EINVAL;
        return -1;
    }
    return (int)syscall(SYS_clock_gettime, clock, now);
}
