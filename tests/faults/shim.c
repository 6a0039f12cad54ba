/* Makes the k-th file operation of a kind fail, come up short or kill the process; only on files in one folder.

   Preloaded (LD_PRELOAD) it stands before the C library's functions, so that HDF5, DuckDB and torch are met as well
   as Python. Nothing happens before `faults_arm`; the state lies in memory that the parent of the process shares. */

#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

enum kind { OPEN, READ, WRITE, FSYNC, RENAME, MKDIR, UNLINK, STAT, LIST, TRUNCATE, KINDS };
enum action { FAIL, FAIL_ON, SHORT, KILL, TORN };

/* As `harness/shim.py` lays it out. */
struct state {
    long counts[KINDS]; /* operations met, by kind */
    long changes;       /* those that change files, of all kinds */
    long at;            /* the operation that is hit, from 1; 0 for none */
    long kind;          /* of that operation; KINDS counts all that change files */
    long action;
    long error;
    long hit; /* how often */
};

static struct state *armed;
static char root[PATH_MAX];
static size_t root_length;

void faults_arm(struct state *state, const char *folder) {
    root_length = strlen(folder);
    memcpy(root, folder, root_length + 1);
    armed = state;
}

static int inside(const char *path) {
    return !strncmp(path, root, root_length) && (path[root_length] == '/' || !path[root_length]);
}

static int inside_fd(int fd) {
    char name[64], path[PATH_MAX];
    snprintf(name, sizeof name, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(name, path, sizeof path - 1);
    if (length < 0) return 0;
    path[length] = 0;
    return inside(path);
}

static int inside_at(int folder, const char *path) {
    if (!path || !*path) return folder >= 0 && inside_fd(folder);
    if (*path == '/') return inside(path);
    if (folder >= 0) return inside_fd(folder);
    char here[PATH_MAX];
    return getcwd(here, sizeof here) && inside(here);
}

/* Whether this operation is the one; a process that is to be killed ends here. */
static int struck(enum kind kind, int is_inside, int changes) {
    if (!is_inside) return 0;
    long n = __atomic_add_fetch(&armed->counts[kind], 1, __ATOMIC_SEQ_CST);
    long change = changes ? __atomic_add_fetch(&armed->changes, 1, __ATOMIC_SEQ_CST) : 0;
    if (armed->kind == KINDS) n = change;
    else if (armed->kind != kind) return 0;
    if (!armed->at || !n) return 0;
    if (armed->action == FAIL_ON ? n < armed->at : n != armed->at) return 0;
    armed->hit++;
    if (armed->action == KILL || (armed->action == TORN && kind != WRITE)) kill(getpid(), SIGKILL);
    errno = (int)armed->error;
    return 1;
}

#define REAL(name) \
    static __typeof__(name) *real; \
    if (!real) real = (__typeof__(name) *)dlsym(RTLD_NEXT, #name)
#define MET(kind, where, changes) (armed && struck(kind, where, changes))
#define PARTLY (armed->action == SHORT || armed->action == TORN)

#define OPENS(name, declared, folder, passed) \
    int name declared { \
        REAL(name); \
        mode_t mode = 0; \
        if (flags & (O_CREAT | __O_TMPFILE)) { \
            va_list rest; \
            va_start(rest, flags); \
            mode = va_arg(rest, mode_t); \
            va_end(rest); \
        } \
        return MET(OPEN, inside_at(folder, path), flags & (O_CREAT | O_TRUNC)) ? -1 : real passed; \
    }
OPENS(open, (const char *path, int flags, ...), AT_FDCWD, (path, flags, mode))
OPENS(open64, (const char *path, int flags, ...), AT_FDCWD, (path, flags, mode))
OPENS(openat, (int folder, const char *path, int flags, ...), folder, (folder, path, flags, mode))
OPENS(openat64, (int folder, const char *path, int flags, ...), folder, (folder, path, flags, mode))

#define FOPENS(name) \
    FILE *name(const char *path, const char *mode) { \
        REAL(name); \
        return MET(OPEN, inside_at(AT_FDCWD, path), *mode != 'r') ? NULL : real(path, mode); \
    }
FOPENS(fopen)
FOPENS(fopen64)

/* Half of what was asked for is moved; of one byte the whole. */
static size_t half(size_t count) { return count / 2 + count % 2; }

#define MOVES(kind, name, changes, declared, passed, partly) \
    ssize_t name declared { \
        REAL(name); \
        if (!MET(kind, inside_fd(fd), changes)) return real passed; \
        if (!PARTLY) return -1; \
        ssize_t moved = real partly; \
        if (armed->action == TORN) kill(getpid(), SIGKILL); \
        return moved; \
    }
MOVES(READ, read, 0, (int fd, void *data, size_t n), (fd, data, n), (fd, data, half(n)))
MOVES(READ, pread, 0, (int fd, void *data, size_t n, off_t at), (fd, data, n, at), (fd, data, half(n), at))
MOVES(READ, pread64, 0, (int fd, void *data, size_t n, off64_t at), (fd, data, n, at), (fd, data, half(n), at))
MOVES(WRITE, write, 1, (int fd, const void *data, size_t n), (fd, data, n), (fd, data, half(n)))
MOVES(WRITE, pwrite, 1, (int fd, const void *data, size_t n, off_t at), (fd, data, n, at), (fd, data, half(n), at))
MOVES(WRITE, pwrite64, 1, (int fd, const void *data, size_t n, off64_t at), (fd, data, n, at), (fd, data, half(n), at))

#define PLAIN(kind, name, where, changes, declared, passed) \
    int name declared { \
        REAL(name); \
        return MET(kind, where, changes) ? -1 : real passed; \
    }
PLAIN(FSYNC, fsync, inside_fd(fd), 1, (int fd), (fd))
PLAIN(FSYNC, fdatasync, inside_fd(fd), 1, (int fd), (fd))
PLAIN(TRUNCATE, ftruncate, inside_fd(fd), 1, (int fd, off_t size), (fd, size))
PLAIN(TRUNCATE, ftruncate64, inside_fd(fd), 1, (int fd, off64_t size), (fd, size))
PLAIN(RENAME, rename, inside_at(AT_FDCWD, to), 1, (const char *from, const char *to), (from, to))
PLAIN(RENAME, renameat, inside_at(b, to), 1, (int a, const char *from, int b, const char *to), (a, from, b, to))
PLAIN(MKDIR, mkdir, inside_at(AT_FDCWD, path), 1, (const char *path, mode_t mode), (path, mode))
PLAIN(MKDIR, mkdirat, inside_at(at, path), 1, (int at, const char *path, mode_t mode), (at, path, mode))
PLAIN(UNLINK, unlink, inside_at(AT_FDCWD, path), 1, (const char *path), (path))
PLAIN(UNLINK, unlinkat, inside_at(at, path), 1, (int at, const char *path, int flags), (at, path, flags))
PLAIN(UNLINK, rmdir, inside_at(AT_FDCWD, path), 1, (const char *path), (path))
PLAIN(UNLINK, remove, inside_at(AT_FDCWD, path), 1, (const char *path), (path))
PLAIN(STAT, stat, inside_at(AT_FDCWD, path), 0, (const char *path, struct stat *to), (path, to))
PLAIN(STAT, stat64, inside_at(AT_FDCWD, path), 0, (const char *path, struct stat64 *to), (path, to))
PLAIN(STAT, lstat, inside_at(AT_FDCWD, path), 0, (const char *path, struct stat *to), (path, to))
PLAIN(STAT, lstat64, inside_at(AT_FDCWD, path), 0, (const char *path, struct stat64 *to), (path, to))
PLAIN(STAT, fstat, inside_fd(fd), 0, (int fd, struct stat *to), (fd, to))
PLAIN(STAT, fstat64, inside_fd(fd), 0, (int fd, struct stat64 *to), (fd, to))
PLAIN(STAT, fstatat, inside_at(at, path), 0, (int at, const char *path, struct stat *to, int f), (at, path, to, f))
PLAIN(STAT, fstatat64, inside_at(at, path), 0, (int at, const char *path, struct stat64 *to, int f), (at, path, to, f))

/* The names of the same calls that libraries built against an older C library use. */
int __xstat(int, const char *, struct stat *), __xstat64(int, const char *, struct stat64 *);
int __lxstat(int, const char *, struct stat *), __lxstat64(int, const char *, struct stat64 *);
int __fxstat(int, int, struct stat *), __fxstat64(int, int, struct stat64 *);
PLAIN(STAT, __xstat, inside_at(AT_FDCWD, path), 0, (int v, const char *path, struct stat *to), (v, path, to))
PLAIN(STAT, __xstat64, inside_at(AT_FDCWD, path), 0, (int v, const char *path, struct stat64 *to), (v, path, to))
PLAIN(STAT, __lxstat, inside_at(AT_FDCWD, path), 0, (int v, const char *path, struct stat *to), (v, path, to))
PLAIN(STAT, __lxstat64, inside_at(AT_FDCWD, path), 0, (int v, const char *path, struct stat64 *to), (v, path, to))
PLAIN(STAT, __fxstat, inside_fd(fd), 0, (int v, int fd, struct stat *to), (v, fd, to))
PLAIN(STAT, __fxstat64, inside_fd(fd), 0, (int v, int fd, struct stat64 *to), (v, fd, to))

DIR *opendir(const char *path) {
    REAL(opendir);
    return MET(LIST, inside_at(AT_FDCWD, path), 0) ? NULL : real(path);
}

DIR *fdopendir(int fd) {
    REAL(fdopendir);
    return MET(LIST, inside_fd(fd), 0) ? NULL : real(fd);
}
