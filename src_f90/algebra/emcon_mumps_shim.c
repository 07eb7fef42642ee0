/* MUMPS behind an opaque pointer: its struct differs from release to release, so Fortran cannot
   bind to it directly. MUMPS keeps module variables while it works: one thread at a time. */
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <dmumps_c.h>

#define JOB_INIT -1
#define JOB_END -2
#define USE_COMM_WORLD -987654
/* As in the manual, from 1. */
#define ICNTL(i) icntl[(i) - 1]
#define INFOG(i) infog[(i) - 1]

enum { analysis = 1, factorisation = 2, solution = 3, most_room = 1000 };
enum { too_little_room = -9, too_little_integer_room = -8 };

typedef struct {
   DMUMPS_STRUC_C id;
   int *irn, *jcn, *place;
} emcon_mumps_t;

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;

static int call(emcon_mumps_t *h, int job)
{
   h->id.job = job;
   pthread_mutex_lock(&lock);
   dmumps_c(&h->id);
   pthread_mutex_unlock(&lock);
   return h->id.INFOG(1);
}

/* symmetry: 0 none, 1 positive definite, 2 symmetric. */
void *emcon_mumps_new(int symmetry)
{
   emcon_mumps_t *h = calloc(1, sizeof *h);
   if (h == NULL) return NULL;
   h->id.comm_fortran = USE_COMM_WORLD;
   h->id.par = 1;
   h->id.sym = symmetry;
   if (call(h, JOB_INIT) < 0) {
      free(h);
      return NULL;
   }
   h->id.ICNTL(1) = h->id.ICNTL(2) = h->id.ICNTL(3) = -1;   /* a library does not write */
   h->id.ICNTL(4) = 0;
   h->id.ICNTL(6) = 0;    /* no permutation by values: a pattern is analysed once */
   h->id.ICNTL(7) = 0;    /* AMD, unless an order is given: the same for every call */
   h->id.ICNTL(8) = 0;    /* values are scaled before, by powers of two */
   h->id.ICNTL(10) = 0;   /* no refinement */
   h->id.ICNTL(12) = 1;
   h->id.ICNTL(13) = 1;   /* negative pivots of the root are counted too */
   h->id.ICNTL(16) = 1;   /* one thread: the same bits */
   return h;
}

static int *copy(const int *from, int n)
{
   int *to = malloc((size_t)(n + 1)*sizeof *to);   /* some room for none, too */
   if (to != NULL) memcpy(to, from, (size_t)n*sizeof *to);
   return to;
}

/* Rows and columns from 1, `n_entry` of them; only one triangle if the matrix is symmetric. `place`:
   when each unknown is eliminated, from 1; without these MUMPS finds an order. */
int emcon_mumps_analyse(void *handle, int n, int n_entry, const int *row, const int *column,
                        int n_place, const int *place)
{
   emcon_mumps_t *h = handle;
   h->irn = copy(row, n_entry);
   h->jcn = copy(column, n_entry);
   h->place = copy(place, n_place);
   if (h->irn == NULL || h->jcn == NULL || h->place == NULL) return -13;
   h->id.n = n;
   h->id.nnz = n_entry;
   h->id.irn = h->irn;
   h->id.jcn = h->jcn;
   h->id.perm_in = h->place;
   if (n_place > 0) h->id.ICNTL(7) = 1;
   return call(h, analysis);
}

/* Status of MUMPS; the figures are set if it is not negative. */
int emcon_mumps_factorise(void *handle, double *value, double *n_factor, int *n_negative)
{
   emcon_mumps_t *h = handle;
   int status;
   h->id.a = value;
   for (;;) {
      status = call(h, factorisation);
      if (status != too_little_room && status != too_little_integer_room) break;
      if (h->id.ICNTL(14) >= most_room) break;
      h->id.ICNTL(14) *= 2;   /* room for pivots that were put off, in per cent */
   }
   if (status < 0) return status;
   *n_factor = h->id.INFOG(29) < 0 ? -1e6*h->id.INFOG(29) : h->id.INFOG(29);
   *n_negative = h->id.INFOG(12);
   return status;
}

/* The solution replaces `x`. */
int emcon_mumps_solve(void *handle, double *x)
{
   emcon_mumps_t *h = handle;
   h->id.nrhs = 1;
   h->id.rhs = x;
   return call(h, solution);
}

void emcon_mumps_free(void *handle)
{
   emcon_mumps_t *h = handle;
   if (h == NULL) return;
   call(h, JOB_END);
   free(h->irn);
   free(h->jcn);
   free(h->place);
   free(h);
}
