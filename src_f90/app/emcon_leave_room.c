/* Before libraries are set up: is there address space for what OpenBLAS takes as it starts?
 *
 * An OpenBLAS with OpenMP takes a work space for each thread before `main`, another one when it is
 * called, and tries for ever where a limit (`ulimit -v`) leaves too little. Functions of
 * .preinit_array run before that: with too little for all threads the program starts anew with one,
 * with too little for one it ends. */
#define _GNU_SOURCE
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

/* What OpenBLAS takes per thread on x86-64, and what may be needed beside it [bytes]. */
static const size_t work_space = (size_t)128 << 20, beside = (size_t)2 << 20;
enum { most_variables = 4096, failed = 3 };

static int has_room(size_t n_thread)
{
   size_t size = n_thread*work_space + beside;
   void *place = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
   if (place == MAP_FAILED) return 0;
   munmap(place, size);
   return 1;
}

/* OpenBLAS takes one more work space when it is first called: 1 if there is room for it. */
int emcon_has_room(void)
{
   struct rlimit limit;
   if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return 1;
   return has_room(1);
}

/* A whole number above 0 in front of a comma or the end; 0: it is none. */
static size_t number_of(const char *text)
{
   size_t n = 0;
   for (; *text >= '0' && *text <= '9' && n < 1000; ++text) n = 10*n + (size_t)(*text - '0');
   return *text == '\0' || *text == ',' ? n : 0;
}

static void leave_room(int argc, char **argv, char **environment)
{
   static const char name[] = "OMP_NUM_THREADS=", one[] = "OMP_NUM_THREADS=1";
   const char *text = "emcon: the limit of address space (ulimit -v) leaves less than 130 MB, which "
                      "OpenBLAS takes when the program starts: raise it\n";
   char *changed[most_variables + 2];
   struct rlimit limit;
   size_t n_thread = 0;
   long n_processor = sysconf(_SC_NPROCESSORS_ONLN);
   int i, n = 0;

   (void)argc;
   if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return;
   for (i = 0; environment[i] != NULL && n < most_variables; ++i) {
      if (strncmp(environment[i], name, sizeof name - 1) == 0) {
         n_thread = number_of(environment[i] + sizeof name - 1);
      } else {
         changed[n++] = environment[i];
      }
   }
   if (n_thread == 0) n_thread = n_processor > 0 ? (size_t)n_processor : 1;
   if (has_room(n_thread + 1)) return;
   if (n_thread == 1 && has_room(1)) return;
   if (n_thread > 1 && has_room(1) && environment[i] == NULL) {
      changed[n++] = (char *)one;
      changed[n] = NULL;
      execve("/proc/self/exe", argv, changed);
   }
   if (write(STDERR_FILENO, text, strlen(text)) < 0) _exit(failed);
   _exit(failed);
}

__attribute__((section(".preinit_array"), used))
static void (*const before_libraries)(int, char **, char **) = leave_room;
