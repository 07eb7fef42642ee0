/* CHOLMOD behind an opaque pointer: cholmod_common differs from release to release, and its
   options are struct members, so Fortran cannot bind to it directly. */
#include <stdlib.h>
#include <suitesparse/cholmod.h>

typedef struct {
   cholmod_common c;
   cholmod_factor *l;
   cholmod_dense *x, *y, *e;      /* solution and workspaces of cholmod_solve2, kept */
   cholmod_sparse *reached;       /* and the entries that a sparse right-hand side reaches */
   int *place;                    /* of each unknown in the order of the factor */
   double *zero;                  /* n zeros between calls */
   double *half;                  /* n, work space */
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
   return h;
}

int emcon_cholmod_analyse(void *handle, int n, int *ap, int *ai)
{
   emcon_cholmod_t *h = handle;
   cholmod_sparse a = view(n, ap, ai, NULL);
   cholmod_free_factor(&h->l, &h->c);
   h->l = cholmod_analyze(&a, &h->c);
   free(h->place);
   free(h->half);
   h->place = NULL;
   h->half = NULL;
   return h->c.status;
}

/* Status of CHOLMOD; the figures are set if it is 0. */
int emcon_cholmod_factorise(void *handle, int n, int *ap, int *ai, double *ax, double *rcond,
                            double *n_factor)
{
   emcon_cholmod_t *h = handle;
   cholmod_sparse a = view(n, ap, ai, ax);
   cholmod_factorize(&a, h->l, &h->c);
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

/* Entries of a factor that are called for before they are needed. */
enum { ahead = 512 };

/* Let the entries from `p` to `end` come into the cache. */
static void call_for(const double *lx, const int *li, int p, int end)
{
   for (; p < end; p += 8) {
      __builtin_prefetch(lx + p);
      __builtin_prefetch(li + p);
   }
}

/* Both halves of a substitution, with CHOLMOD's own bits: up to three columns that have the same
   rows below them are taken together. What comes next is called for, without which a factor that
   does not fit the cache takes twice as long. Column j has lnz[j] entries from lp[j] on. */

/* x = L^-1 x */
static void substitute(int n, const int *lp, const int *lnz, const int *li, const double *lx,
                       double *x)
{
   int j = 0;
   while (j < n) {
      int p = lp[j], end = p + lnz[j];
      if (lnz[j] < 4 || lnz[j] != lnz[j + 1] + 1 || li[p + 1] != j + 1) {
         double y = x[j] /= lx[p];
         call_for(lx, li, p + ahead, end + ahead);
         for (p++; p < end; p++) x[li[p]] -= lx[p]*y;
         j++;
      } else if (lnz[j] != lnz[j + 2] + 2 || li[p + 2] != j + 2) {
         int q = lp[j + 1];
         double y0 = x[j]/lx[p], y1 = (x[j + 1] - lx[p + 1]*y0)/lx[q];
         call_for(lx, li, p + ahead, end + lnz[j] + ahead);
         x[j] = y0;
         x[j + 1] = y1;
         for (p += 2, q++; p < end; p++, q++) x[li[p]] -= lx[p]*y0 + lx[q]*y1;
         j += 2;
      } else {
         int q = lp[j + 1], r = lp[j + 2];
         double y0 = x[j]/lx[p], y1 = (x[j + 1] - lx[p + 1]*y0)/lx[q];
         double y2 = (x[j + 2] - lx[p + 2]*y0 - lx[q + 1]*y1)/lx[r];
         call_for(lx, li, p + ahead, end + 2*lnz[j] + ahead);
         x[j] = y0;
         x[j + 1] = y1;
         x[j + 2] = y2;
         for (p += 3, q += 2, r++; p < end; p++, q++, r++)
            x[li[p]] -= lx[p]*y0 + lx[q]*y1 + lx[r]*y2;
         j += 3;
      }
   }
}

/* x = L^-T x */
static void substitute_back(int n, const int *lp, const int *lnz, const int *li, const double *lx,
                            double *x)
{
   int j = n - 1;
   while (j >= 0) {
      int p = lp[j], end = p + lnz[j];
      double d0 = lx[p];
      if (j < 4 || lnz[j] != lnz[j - 1] - 1 || li[lp[j - 1] + 1] != j) {
         double y = x[j];
         call_for(lx, li, p - ahead, end - ahead);
         for (p++; p < end; p++) y -= lx[p]*x[li[p]];
         x[j] = y/d0;
         j--;
      } else if (lnz[j] != lnz[j - 2] - 2 || li[lp[j - 2] + 2] != j) {
         int q = lp[j - 1];
         double d1 = lx[q], t = lx[q + 1], y0 = x[j], y1 = x[j - 1];
         call_for(lx, li, q - ahead, end - ahead);
         for (p++, q += 2; p < end; p++, q++) {
            double y = x[li[p]];
            y0 -= lx[p]*y;
            y1 -= lx[q]*y;
         }
         y0 /= d0;
         x[j - 1] = (y1 - t*y0)/d1;
         x[j] = y0;
         j -= 2;
      } else {
         int q = lp[j - 1], r = lp[j - 2];
         double d1 = lx[q], d2 = lx[r], t = lx[q + 1], u = lx[r + 1], v = lx[r + 2];
         double y0 = x[j], y1 = x[j - 1], y2 = x[j - 2];
         call_for(lx, li, r - ahead, end - ahead);
         for (p++, q += 2, r += 3; p < end; p++, q++, r++) {
            double y = x[li[p]];
            y0 -= lx[p]*y;
            y1 -= lx[q]*y;
            y2 -= lx[r]*y;
         }
         y0 /= d0;
         y1 = (y1 - t*y0)/d1;
         y2 = (y2 - v*y0 - u*y1)/d2;
         x[j - 2] = y2;
         x[j - 1] = y1;
         x[j] = y0;
         j -= 3;
      }
   }
}

/* x = L^-1 P b, or x = P^T L^-T b. */
int emcon_cholmod_half(void *handle, int n, int is_second, double *b, double *x)
{
   emcon_cholmod_t *h = handle;
   const cholmod_factor *l = h->l;
   const int *perm = l->Perm;
   int i;
   if (!is_second) {
      for (i = 0; i < n; i++) x[i] = b[perm[i]];
      substitute(n, l->p, l->nz, l->i, l->x, x);
      return CHOLMOD_OK;
   }
   if (h->half == NULL) h->half = malloc((size_t)n*sizeof *h->half);
   if (h->half == NULL) return CHOLMOD_OUT_OF_MEMORY;
   for (i = 0; i < n; i++) h->half[i] = b[i];
   substitute_back(n, l->p, l->nz, l->i, l->x, h->half);
   for (i = 0; i < n; i++) x[perm[i]] = h->half[i];
   return CHOLMOD_OK;
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
   cholmod_free_dense(&h->x, &h->c);
   cholmod_free_dense(&h->y, &h->c);
   cholmod_free_dense(&h->e, &h->c);
   cholmod_free_sparse(&h->reached, &h->c);
   free(h->place);
   free(h->zero);
   free(h->half);
   cholmod_finish(&h->c);
   free(h);
}
