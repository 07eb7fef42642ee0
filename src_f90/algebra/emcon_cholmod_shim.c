/* CHOLMOD behind an opaque pointer: cholmod_common differs from release to release, and its
   options are struct members, so Fortran cannot bind to it directly. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>
#include <suitesparse/cholmod.h>

typedef struct {
   cholmod_common c;
   cholmod_factor *l;
   cholmod_factor *nodes;         /* the pattern of l by columns that are taken together */
   cholmod_dense *x, *y, *e;      /* solution and workspaces of cholmod_solve2, kept */
   cholmod_sparse *reached;       /* and the entries that a sparse right-hand side reaches */
   int *place;                    /* of each unknown in the order of the factor */
   double *zero;                  /* n zeros between calls */
   int (*levels)(void);           /* of OpenMP, where CHOLMOD uses it */
   void (*set_levels)(int);
   int (*threads)(void);          /* and of the thread that calls */
   void (*set_threads)(int);
} emcon_cholmod_t;

/* View of a full symmetric matrix: CSR is CSC here; CHOLMOD reads the lower triangle only. */
static cholmod_sparse view(int n, int *ap, int *ai, double *ax)
{
   cholmod_sparse a = {0};
   a.nrow = a.ncol = (size_t)n;
   a.nzmax = (size_t)ap[n];
   a.p = ap;
   a.i = ai;
   a.x = ax;
   a.stype = -1;
   a.itype = CHOLMOD_INT;
   a.xtype = ax ? CHOLMOD_REAL : CHOLMOD_PATTERN;
   a.dtype = CHOLMOD_DOUBLE;
   a.sorted = a.packed = 1;
   return a;
}

/* `halves`: each half of the factor is to be solved with, for sparse right-hand sides. */
void *emcon_cholmod_new(int halves)
{
   emcon_cholmod_t *h = calloc(1, sizeof *h);
   if (h == NULL) return NULL;
   if (!cholmod_start(&h->c)) {
      free(h);
      return NULL;
   }
   h->c.print = 0;       /* a library does not write to stdout */
   h->c.final_ll = 1;    /* else LDL^T accepts indefinite matrices */
   if (halves) h->c.supernodal = CHOLMOD_SIMPLICIAL;
   *(void **)(&h->levels) = dlsym(RTLD_DEFAULT, "omp_get_max_active_levels");
   *(void **)(&h->set_levels) = dlsym(RTLD_DEFAULT, "omp_set_max_active_levels");
   *(void **)(&h->threads) = dlsym(RTLD_DEFAULT, "omp_get_max_threads");
   *(void **)(&h->set_threads) = dlsym(RTLD_DEFAULT, "omp_set_num_threads");
   return h;
}

/* Factorise on this thread alone. Fronts here are small: the four threads that CHOLMOD would start,
   whatever the environment says, wait for each other most of the time. OpenBLAS, which asks OpenMP
   how many threads there are and waits until so many have come, must then be told one: with no
   level of threads it would wait for ever. Both settings are those of the calling thread. */
static void factorise(emcon_cholmod_t *h, cholmod_sparse *a, cholmod_factor *l)
{
   const int can_set = h->levels != NULL && h->set_levels != NULL && h->threads != NULL
      && h->set_threads != NULL;
   const int levels = can_set ? h->levels() : 0, threads = can_set ? h->threads() : 0;
   if (can_set) {
      h->set_levels(0);
      h->set_threads(1);
   }
   cholmod_factorize(a, l, &h->c);
   if (can_set) {
      h->set_threads(threads);
      h->set_levels(levels);
   }
}

int emcon_cholmod_analyse(void *handle, int n, int *ap, int *ai)
{
   emcon_cholmod_t *h = handle;
   cholmod_sparse a = view(n, ap, ai, NULL);
   cholmod_free_factor(&h->l, &h->c);
   h->l = cholmod_analyze(&a, &h->c);
   free(h->place);
   h->place = NULL;
   return h->c.status;
}

/* Operations of a factorisation, and entries of the factor, as analysed. */
void emcon_cholmod_counts(void *handle, double *work, double *n_factor)
{
   const emcon_cholmod_t *h = handle;
   *work = h->c.fl;
   *n_factor = h->c.lnz;
}

/* The pattern of the factor in the same order, by columns that are taken together: how many of these
   nodes there are, and rows of all of them. */
int emcon_cholmod_nodes(void *handle, int n, int *ap, int *ai, int *n_node, int *n_row)
{
   emcon_cholmod_t *h = handle;
   cholmod_sparse a = view(n, ap, ai, NULL);
   const int supernodal = h->c.supernodal, n_methods = h->c.nmethods,
             ordering = h->c.method[0].ordering;
   int status;
   cholmod_free_factor(&h->nodes, &h->c);
   h->c.supernodal = CHOLMOD_SUPERNODAL;
   h->c.nmethods = 1;
   h->c.method[0].ordering = CHOLMOD_GIVEN;
   h->nodes = cholmod_analyze_p(&a, h->l->Perm, NULL, 0, &h->c);
   status = h->c.status;
   h->c.supernodal = supernodal;
   h->c.nmethods = n_methods;
   h->c.method[0].ordering = ordering;
   if (status != CHOLMOD_OK) return status;
   *n_node = (int)h->nodes->nsuper;
   *n_row = (int)h->nodes->ssize;
   return status;
}

/* What `emcon_cholmod_nodes` has found, all from 0. */
void emcon_cholmod_take_nodes(void *handle, int *order, int *first, int *row_start, int *row)
{
   emcon_cholmod_t *h = handle;
   const cholmod_factor *l = h->nodes;
   memcpy(order, l->Perm, l->n*sizeof *order);
   memcpy(first, l->super, (l->nsuper + 1)*sizeof *first);
   memcpy(row_start, l->pi, (l->nsuper + 1)*sizeof *row_start);
   memcpy(row, l->s, l->ssize*sizeof *row);
}

/* Factorise by the nodes, on dense blocks. For halves of sparse right-hand sides the factor is then
   that of single columns, without the zeros that blocks are filled up by. */
static void factorise_nodes(emcon_cholmod_t *h, cholmod_sparse *a)
{
   cholmod_factor *l = cholmod_copy_factor(h->nodes, &h->c);
   if (l == NULL) return;
   h->c.final_super = 0;
   h->c.final_resymbol = 1;
   factorise(h, a, l);
   cholmod_free_factor(&h->l, &h->c);
   free(h->place);
   h->place = NULL;
   h->l = l;
}

/* Status of CHOLMOD; the figures are set if it is 0. */
int emcon_cholmod_factorise(void *handle, int n, int *ap, int *ai, double *ax, double *rcond,
                            double *n_factor)
{
   emcon_cholmod_t *h = handle;
   cholmod_sparse a = view(n, ap, ai, ax);
   if (h->nodes != NULL)
      factorise_nodes(h, &a);
   else
      factorise(h, &a, h->l);
   if (h->c.status != CHOLMOD_OK) return h->c.status;
   if (h->l->minor < h->l->n) return CHOLMOD_NOT_POSDEF;
   *rcond = cholmod_rcond(h->l, &h->c);
   *n_factor = h->c.lnz;
   return h->c.status;
}

int emcon_cholmod_solve(void *handle, int n, double *b, double *x)
{
   emcon_cholmod_t *h = handle;
   cholmod_dense rhs = {0};
   int i;
   rhs.nrow = rhs.d = rhs.nzmax = (size_t)n;
   rhs.ncol = 1;
   rhs.x = b;
   rhs.xtype = CHOLMOD_REAL;
   rhs.dtype = CHOLMOD_DOUBLE;
   if (!cholmod_solve2(CHOLMOD_A, h->l, &rhs, NULL, &h->x, NULL, &h->y, &h->e, &h->c))
      return h->c.status == CHOLMOD_OK ? CHOLMOD_INVALID : h->c.status;
   for (i = 0; i < n; i++) x[i] = ((double *)h->x->x)[i];
   return h->c.status;
}

/* x = L^-1 P b, or x = P^T L^-T b. */
int emcon_cholmod_half(void *handle, int n, int is_second, double *b, double *x)
{
   emcon_cholmod_t *h = handle;
   const int *perm = h->l->Perm;
   cholmod_dense rhs = {0};
   const double *y;
   int i;
   if (!is_second)
      for (i = 0; i < n; i++) x[i] = b[perm[i]];
   rhs.nrow = rhs.d = rhs.nzmax = (size_t)n;
   rhs.ncol = 1;
   rhs.x = is_second ? b : x;
   rhs.xtype = CHOLMOD_REAL;
   rhs.dtype = CHOLMOD_DOUBLE;
   if (!cholmod_solve2(is_second ? CHOLMOD_Lt : CHOLMOD_L, h->l, &rhs, NULL, &h->x, NULL, &h->y,
                       &h->e, &h->c))
      return h->c.status == CHOLMOD_OK ? CHOLMOD_INVALID : h->c.status;
   y = h->x->x;
   if (is_second)
      for (i = 0; i < n; i++) x[perm[i]] = y[i];
   else
      for (i = 0; i < n; i++) x[i] = y[i];
   return h->c.status;
}

static int places(emcon_cholmod_t *h, int n)
{
   const int *perm = h->l->Perm;
   int i;
   if (h->place != NULL) return CHOLMOD_OK;
   free(h->zero);
   h->zero = calloc((size_t)n, sizeof *h->zero);
   h->place = malloc((size_t)n*sizeof *h->place);
   if (h->zero == NULL || h->place == NULL) return CHOLMOD_OUT_OF_MEMORY;
   for (i = 0; i < n; i++) h->place[perm[i]] = i;
   return CHOLMOD_OK;
}

/* L^-1 P b of a vector with the entries `value` at the unknowns `column`: what of it is not zero,
   `n_reached` entries at `index`, from 0, in the order of the factor. */
int emcon_cholmod_reach(void *handle, int n, int m, const int *column, const double *value,
                        int *n_reached, int *index, double *x)
{
   emcon_cholmod_t *h = handle;
   cholmod_dense rhs = {0};
   cholmod_sparse pattern = {0};
   int p[2], *i = index, k, status = places(h, n);
   if (status != CHOLMOD_OK) return status;
   p[0] = 0;
   p[1] = m;
   for (k = 0; k < m; k++) {
      i[k] = h->place[column[k]];
      h->zero[i[k]] = value[k];
   }
   pattern.nrow = (size_t)n;
   pattern.ncol = 1;
   pattern.nzmax = (size_t)m;
   pattern.p = p;
   pattern.i = i;
   pattern.itype = CHOLMOD_INT;
   pattern.xtype = CHOLMOD_PATTERN;
   pattern.dtype = CHOLMOD_DOUBLE;
   pattern.packed = 1;
   rhs.nrow = rhs.d = rhs.nzmax = (size_t)n;
   rhs.ncol = 1;
   rhs.x = h->zero;
   rhs.xtype = CHOLMOD_REAL;
   rhs.dtype = CHOLMOD_DOUBLE;
   status = CHOLMOD_OK;
   if (!cholmod_solve2(CHOLMOD_L, h->l, &rhs, &pattern, &h->x, &h->reached, &h->y, &h->e, &h->c))
      status = h->c.status == CHOLMOD_OK ? CHOLMOD_INVALID : h->c.status;
   for (k = 0; k < m; k++) h->zero[i[k]] = 0.0;
   if (status != CHOLMOD_OK) return status;
   *n_reached = ((int *)h->reached->p)[1];
   for (k = 0; k < *n_reached; k++) {
      index[k] = ((int *)h->reached->i)[k];
      x[k] = ((double *)h->x->x)[index[k]];
   }
   return h->c.status;
}

void emcon_cholmod_free(void *handle)
{
   emcon_cholmod_t *h = handle;
   if (h == NULL) return;
   cholmod_free_factor(&h->l, &h->c);
   cholmod_free_factor(&h->nodes, &h->c);
   cholmod_free_dense(&h->x, &h->c);
   cholmod_free_dense(&h->y, &h->c);
   cholmod_free_dense(&h->e, &h->c);
   cholmod_free_sparse(&h->reached, &h->c);
   free(h->place);
   free(h->zero);
   cholmod_finish(&h->c);
   free(h);
}
