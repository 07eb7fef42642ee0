/* CHOLMOD behind an opaque pointer: cholmod_common differs from release to release, and its
   options are struct members, so Fortran cannot bind to it directly. */
#include <stdlib.h>
#include <suitesparse/cholmod.h>

typedef struct {
   cholmod_common c;
   cholmod_factor *l;
   cholmod_dense *x, *y, *e;      /* solution and workspaces of cholmod_solve2, kept */
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

void *emcon_cholmod_new(void)
{
   emcon_cholmod_t *h = calloc(1, sizeof *h);
   if (h == NULL) return NULL;
   if (!cholmod_start(&h->c)) {
      free(h);
      return NULL;
   }
   h->c.print = 0;       /* a library does not write to stdout */
   h->c.final_ll = 1;    /* else LDL^T accepts indefinite matrices */
   return h;
}

int emcon_cholmod_analyse(void *handle, int n, int *ap, int *ai)
{
   emcon_cholmod_t *h = handle;
   cholmod_sparse a = view(n, ap, ai, NULL);
   cholmod_free_factor(&h->l, &h->c);
   h->l = cholmod_analyze(&a, &h->c);
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

void emcon_cholmod_free(void *handle)
{
   emcon_cholmod_t *h = handle;
   if (h == NULL) return;
   cholmod_free_factor(&h->l, &h->c);
   cholmod_free_dense(&h->x, &h->c);
   cholmod_free_dense(&h->y, &h->c);
   cholmod_free_dense(&h->e, &h->c);
   cholmod_finish(&h->c);
   free(h);
}
