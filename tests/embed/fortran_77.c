/* Contact from EMCON for codes in the manner of Fortran 77: subroutines with short names, default
 * integers, double precision, over the functions of emcon.h. `host_driver.f` takes contact through
 * them; what else a code needs is added the same way.
 *
 * A handle is three integers of the host: the address of the model in two of them, and a word made
 * of these, by which an array that is no handle is told. Every subroutine ends with IERR: 0 done, 2
 * wrong input, 3 it cannot be computed; EMMSG gives the text. Nodes, surfaces, contacts and entries
 * of matrices count from 1, flags are 0 and 1. Compilers append an underscore to the names of
 * external subroutines: CALL EMNEW(...) finds `emnew_`. */
#include <emcon.h>
#include <stdio.h>
#include <string.h>

enum { MARK = 1146438477, ROOM = 200 };

static int word_of(const int *ih) { return ih[0] ^ (ih[1] << 7) ^ MARK; }

/* The model of a handle, NULL for what is none. */
static emcon_model *model_of(const int *ih)
{
   emcon_model *model = NULL;

   if (ih[2] == word_of(ih)) memcpy(&model, ih, sizeof model);
   return model;
}

/* Make a model of N nodes at X(2,N). Also where this fails there is a handle to free. */
void emnew_(int *ih, const int *n, const double *x, int *ierr)
{
   emcon_model *model;

   *ierr = emcon_new(*n, 2, x, &model);
   ih[1] = 0;
   memcpy(ih, &model, sizeof model);
   ih[2] = word_of(ih);
}

/* Add a surface of NE edges IED(2,NE), first and last node, the body to the left; IS becomes its
 * number. */
void emsurf_(const int *ih, const int *ne, const int *ied, int *is, int *ierr)
{
   int edge[2*ROOM], i;

   *ierr = EMCON_ERROR_INPUT;
   if (*ne > ROOM) return;
   for (i = 0; i < 2**ne; i++) edge[i] = ied[i] - 1;
   *ierr = emcon_add_surface(model_of(ih), NULL, *ne, edge, is);
   ++*is;
}

/* Add a contact pair of surfaces. IFORM: 1 node to segment, 2 segment, 3 mortar. IOPT(5) and
 * ANGLE(2): the components of emcon_pair_options, 0 for the default. */
void empair_(const int *ih, const int *islave, const int *master, const int *iform,
             const int *iopt, const double *angle, int *ierr)
{
   emcon_pair_options options = {iopt[0], iopt[1], iopt[2], iopt[3], iopt[4], angle[0], angle[1]};

   *ierr = emcon_add_pair(model_of(ih), *islave - 1, *master - 1, *iform, &options);
}

/* Finish. IHELD(2,N) = 1 for freedoms that the host moves by itself. X(2,N) becomes the positions
 * that fulfil the ties; M is the number of possible contacts. */
void emprep_(const int *ih, const int *n, const int *iheld, double *x, int *m, int *ierr)
{
   emcon_model *model = model_of(ih);
   emcon_sizes sizes;

   *m = 0;
   *ierr = emcon_hold(model, *n, iheld);
   if (*ierr == EMCON_OK) *ierr = emcon_build(model);
   if (*ierr == EMCON_OK) *ierr = emcon_get_positions(model, *n, x);
   if (*ierr != EMCON_OK) return;
   emcon_get_sizes(model, &sizes);
   *m = sizes.n_constraint;
}

/* Begin a step from U0(2,N) by DU(2,N). IWAS(M): contacts that acted before; IACT(M): those that
 * still can. */
void embeg_(const int *ih, const int *n, const int *m, const double *u0, const double *du,
            const int *iwas, int *iact, int *ierr)
{
   *ierr = emcon_begin_contact(model_of(ih), *n, u0, du, *m, iwas, iact);
}

/* All gaps at the start, G0(M), and at the end of the step, G1(M), where NEAR(M) is 1. */
void emgap_(const int *ih, const int *n, const int *m, const double *u0, const double *du,
            int *near, double *g0, double *g1, int *ierr)
{
   emcon_gap gap[ROOM];
   int i;

   *ierr = EMCON_ERROR_INPUT;
   if (*m > ROOM) return;
   *ierr = emcon_get_gaps(model_of(ih), *n, u0, du, *m, gap);
   for (i = 0; *ierr == EMCON_OK && i < *m; i++) {
      near[i] = gap[i].is_near;
      g0[i] = gap[i].gap0;
      g1[i] = gap[i].gap1;
   }
}

/* Select the contacts IACT(M). There are K. */
void emsel_(const int *ih, const int *n, const int *m, const double *u0, const double *du,
            const int *iact, int *k, int *ierr)
{
   *k = 0;
   *ierr = emcon_select(model_of(ih), *n, u0, du, *m, iact, k);
}

/* A sparse matrix by rows: row I has the entries IROW(I) to IROW(I+1)-1 of ICOL and VAL, which have
 * room for MAXNZ; NZ is the number of them, also where the room is too small. */
static int copy_matrix(const emcon_csr *matrix, int maxnz, int *nz, int *irow, int *icol,
                       double *val)
{
   int i;

   *nz = matrix->n_row ? matrix->row_start[matrix->n_row] : 0;
   if (*nz > maxnz) return EMCON_ERROR_INPUT;
   for (i = 0; i <= matrix->n_row; i++) irow[i] = matrix->n_row ? matrix->row_start[i] + 1 : 1;
   for (i = 0; i < *nz; i++) icol[i] = matrix->column[i] + 1, val[i] = matrix->value[i];
   return EMCON_OK;
}

/* The K selected contacts: rows of discrete gradients G and of gradients at the end C, one pattern
 * over 2 N freedoms; DEFECT(K) is to become 0, DGAP(K) is the change of the gap. */
void emeval_(const int *ih, const int *n, const int *k, const double *u0, const double *du,
             const int *maxnz, int *nz, int *irow, int *icol, double *g, double *c,
             double *defect, double *dgap, int *ierr)
{
   emcon_constraint_report report;
   int i;

   *ierr = emcon_evaluate_contact(model_of(ih), *n, u0, du, &report);
   if (*ierr == EMCON_OK && report.n != *k) *ierr = EMCON_ERROR_INPUT;
   if (*ierr != EMCON_OK) return;
   *ierr = copy_matrix(&report.end_gradient, *maxnz, nz, irow, icol, c);
   if (*ierr == EMCON_OK) *ierr = copy_matrix(&report.discrete_gradient, *maxnz, nz, irow, icol, g);
   for (i = 0; i < *k; i++) defect[i] = report.defect[i], dgap[i] = report.dgap[i];
}

/* Sum of ALAM(I) times the derivative of row I of G by the motion, 2 N rows. */
void emcurv_(const int *ih, const int *k, const double *alam, const int *maxnz, int *nz, int *irow,
             int *icol, double *val, int *ierr)
{
   emcon_csr matrix;

   *ierr = emcon_curvature(model_of(ih), *k, alam, &matrix);
   if (*ierr == EMCON_OK) *ierr = copy_matrix(&matrix, *maxnz, nz, irow, icol, val);
}

/* The next set IACT(M) after the step was solved with the selected one; IDONE = 1: it stands, or
 * ISTAT is not 0 and the step cannot be ended. AMAG(2,N): sums of |contributions| to the
 * residual. */
void emupd_(const int *ih, const int *n, const int *m, const double *u0, const double *du,
            const int *k, const double *alam, const double *amag, int *iact, int *idone,
            int *istat, int *ierr)
{
   *ierr = emcon_update_active(model_of(ih), *n, u0, du, *k, alam, amag, *m, iact, idone, istat);
}

/* The text of the last failure, in blanks up to the length L of TEXT. */
void emmsg_(const int *ih, const int *l, char *text)
{
   const char *message = model_of(ih) ? emcon_message(model_of(ih))
      : "this is no handle: it was never made, or freed";
   int i, end = 0;

   for (i = 0; i < *l; i++) {
      end = end || !message[i];
      text[i] = end ? ' ' : message[i];
   }
}

/* Free a model; its handle becomes 0. Harmless for what is no handle. */
void emfree_(int *ih)
{
   emcon_close(model_of(ih));
   memset(ih, 0, 3*sizeof *ih);
}
