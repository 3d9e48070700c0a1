# check_platform.sh COMPILER -- no file of lib/ or apps/ but platform.h and platform_*.c includes a header or
# calls a function that is not C99's, OpenCL's, the compiler's, or a library's that we link (`make check-platform`).
#
# Headers by an allowed list. Calls by a list of what POSIX, GNU and Microsoft have, looked up in what the preprocessor
# leaves of comments and strings. Errors planted into a copy of one file are to be found, too.
compiler=$1
allowed='assert ctype emmintrin errno float inttypes limits locale math setjmp signal stdarg stdbool stddef stdint stdio stdlib
string time CL/cl OpenEXR/openexr stb/stb_image stb/stb_image_write expat jerror jpeglib zlib'
# C++ headers have no dot; tiny_obj_loader is its only other one.
refused='access alarm asprintf basename bind chdir chmod chown clock_getres clock_gettime close closedir connect dirname
dirfd dlclose dlerror dlopen dlsym dprintf dup dup2 execl execlp execv execve execvp faccessat fchmod fcntl fdatasync
fdopen ffs fileno flock flockfile fmemopen fnmatch fork freelocale fseeko fstat fstatat fsync ftello ftruncate futimens
getcwd getdelim getegid geteuid getgid gethostname getline getopt getopt_long getpagesize getpgid getpid getppid
getpwuid getrlimit getrusage gettimeofday getuid glob gmtime_r ioctl isatty kill killpg link localtime_r lseek lstat
madvise memccpy memmem mempcpy mkdir mkdirat mkdtemp mkfifo mkostemp mkstemp mktemp mlock mmap mprotect msync munmap
nanosleep newlocale nftw nice open open_memstream openat opendir pathconf pause pclose pipe pipe2 poll popen
posix_fadvise posix_fallocate posix_madvise posix_memalign posix_spawn posix_spawnp ppoll prctl pread pselect pwrite
qsort_r rand_r read readdir readlink readv realpath recv rmdir sched_yield secure_getenv select send setenv setlinebuf
setpgid setrlimit setsid shm_open shm_unlink sigaction sigaddset sigemptyset siglongjmp sigpending sigprocmask
sigsetjmp sigtimedwait sigwait sleep socket stat stpcpy stpncpy strcasecmp strcasestr strchrnul strdup strerror_r
strncasecmp strndup strnlen strsep strsignal strtod_l strtok_r symlink sync sysconf truncate ttyname uname unlink
unlinkat unsetenv uselocale usleep utime utimensat utimes vasprintf vdprintf vfork wait waitid waitpid write writev
CreateDirectoryA CreateFileA DeleteFileA LoadLibraryA GetProcAddress Sleep WaitForSingleObject'

# The text without comments and strings, one line for each of the file's, ready for grep -n.
plain() {
    "$compiler" -fpreprocessed -dD -E -P -x c "$1" 2>/dev/null | sed 's/"\([^"\\]\|\\.\)*"/""/g; s/'"'"'\(\\.\|[^\\]\)'"'"'/0/g'
}

# Prints what is wrong with the files; its status is how many errors there are, 100 at most.
check() {
    errors=0
    for file; do
        case ${file##*/} in platform.h | platform_posix.c | platform_windows.c) continue ;; esac
        for header in $(sed -n 's/^ *# *include *<\(.*\)>.*/\1/p' "$file"); do
            case " $(echo $allowed) tiny_obj_loader " in *" ${header%.h} "*) continue ;; esac
            case $header in *.h) ;; *) continue ;; esac
            echo "$file: <$header> is not C99's: lib/platform.h, apps/platform.h"
            errors=$((errors + 1))
        done
        # A call: a name, then a parenthesis; not a member, and not the declaration of a member or parameter.
        calls=$(plain "$file" | grep -v '^ *#' | grep -oE '(^|[^A-Za-z0-9_.>*])[A-Za-z_][A-Za-z0-9_]* *\(' | tr -d ' (' |
                sed 's/^[^A-Za-z_]//' | sort -u)
        for call in $calls; do
            case " $(echo $refused) " in
                *" $call "*) ;;
                *) case $call in pthread_* | _[a-z]*) ;; *) continue ;; esac
                   case $call in __attribute__ | __atomic_* | __builtin_* | _mm_*) continue ;; esac ;;
            esac
            # A function of the file's own by that name is the file's own.
            grep -qE "^(static )?[a-z][A-Za-z0-9_ *]* \*?$call\(.*\)? ?\{?\$" "$file" && continue
            echo "$file: $call() is not C99's: lib/platform.h, apps/platform.h"
            errors=$((errors + 1))
        done
    done
    return $((errors > 100 ? 100 : errors))
}

check lib/*.c lib/*.h lib/*.cc apps/*.c apps/*.h
found=$?

# Proof that it finds what it looks for.
planted=$(mktemp -d) || exit 1
trap 'rm -rf "$planted"' EXIT
for bug in '#include <unistd.h>' '#include <pthread.h>' '#include <windows.h>' '#include <sys/stat.h>'; do
    { cat lib/text.c; echo "$bug"; } >"$planted/text.c"
    check "$planted/text.c" >/dev/null && { echo "check-platform: planted, not found: $bug"; found=$((found + 1)); }
done
for bug in 'unlink("a")' 'clock_gettime(0, 0)' 'pthread_mutex_lock(0)' 'strdup("a")' '_exit(1)' 'mkstemp("b")'; do
    { cat lib/text.c; printf 'int planted(void);\nint planted(void) { return (int)%s; }\n' "$bug"; } >"$planted/text.c"
    check "$planted/text.c" >/dev/null && { echo "check-platform: planted, not found: $bug"; found=$((found + 1)); }
done
[ $found -eq 0 ] && echo "check-platform: lib/ and apps/ ask the system through platform.h alone"
[ $found -eq 0 ]
