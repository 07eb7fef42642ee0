/* Contact from EMCON for codes in the manner of Fortran 77: subroutines with short names, default
 * integers, double precision, over the functions of emcon.h. `host_77.f` takes contact through them;
 * what else a code needs is added the same way.
 *
 * A handle is three integers of the host: the address of the model in two of them, and a word made
 * of these, by which an array that is no handle is told. Every subroutine ends with IERR: 0 done, 2
 * wrong input, 3 it cannot be computed; EMMSG gives the text. Nodes, surfaces, contacts and entries
 * of matrices count from 1, flags are 0 and 1. Compilers append an underscore to the names of
 * external subroutines: CALL EMNEW(...) finds `emnew_`. */
#include <emcon.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MARK = 1146438477 };

static int word_of(const int *ih) { return ih[0] ^ (ih[1] << 7) ^ MARK; }

/* The model of a handle, NULL for what is none. */
static emcon_model *model_of(const int *ih)
{
   emcon_model *model = NULL;

   if (ih[2] == word_of(ih)) memcpy(&model, ih, sizeof model);
   return model;
}

/* Room for n times m numbers of a size; NULL, which the library refuses, if there is none. */
static void *room(int n, int m, size_t of_one)
{
   return n > 0 && m > 0 ? malloc((size_t)n*(size_t)m*of_one) : NULL;
}

/* Make a model of N nodes at X(ND,N), ND = 2 or 3. Also where this fails there is a handle to free.
 * Arrays of two extents are (ND,N) below. */
void emnew_(int *ih, const int *nd, const int *n, const double *x, int *ierr)
{
   emcon_model *model;

   *ierr = emcon_new(*n, *nd, x, &model);
   ih[1] = 0;
   memcpy(ih, &model, sizeof model);
   ih[2] = word_of(ih);
}

/* Add a surface of NE edges IED(2,NE), first and last node, the body to the left; IS becomes its
 * number. */
void emsurf_(const int *ih, const int *ne, const int *ied, int *is, int *ierr)
{
   int *edge = room(*ne, 2, sizeof *edge), i;

   for (i = 0; edge && i < 2**ne; i++) edge[i] = ied[i] - 1;
   *ierr = emcon_add_surface(model_of(ih), NULL, *ne, edge, is);
   ++*is;
   free(edge);
}

/* In space: add a surface of NF faces IFACE(KN,NF), each of KN nodes, 3, 4, 6 or 8, the corners
 * counter-clockwise as seen from outside; IS becomes its number. */
void emface_(const int *ih, const int *kn, const int *nf, const int *iface, int *is, int *ierr)
{
   int *node = room(*kn, *nf, sizeof *node), *kind = room(*nf, 1, sizeof *kind);
   int *offset = room(*nf, 1, sizeof *offset), i;

   for (i = 0; node && i < *kn**nf; i++) node[i] = iface[i] - 1;
   for (i = 0; kind && offset && i < *nf; i++) {
      kind[i] = *kn == 3 ? 5 : *kn == 4 ? 9 : *kn == 6 ? 22 : *kn == 8 ? 23 : 0;
      offset[i] = (i + 1)**kn;
   }
   *ierr = emcon_add_faces(model_of(ih), NULL, *nf, kind, offset, *kn**nf, node, is);
   ++*is;
   free(node);
   free(kind);
   free(offset);
}

/* Add a contact pair of surfaces with the coefficient of friction FRICT. IFORM: see EMPAIR. */
void emrub_(const int *ih, const int *islave, const int *master, const int *iform,
            const double *frict, int *ierr)
{
   emcon_pair_options options = {0};

   options.friction = *frict;
   *ierr = emcon_add_pair(model_of(ih), *islave - 1, *master - 1, *iform, &options);
}

/* Add a contact pair of surfaces. IFORM: 1 node to segment, 2 segment, 3 mortar. IOPT(5) and
 * ANGLE(2): the components of emcon_pair_options, 0 for the default. */
void empair_(const int *ih, const int *islave, const int *master, const int *iform,
             const int *iopt, const double *angle, int *ierr)
{
   emcon_pair_options options = {0};

   options.integration = iopt[0];
   options.n_point = iopt[1];
   options.multiplier = iopt[2];
   options.normal = iopt[3];
   options.smoothing = iopt[4];
   options.normal_angle = angle[0];
   options.smoothing_angle = angle[1];
   *ierr = emcon_add_pair(model_of(ih), *islave - 1, *master - 1, *iform, &options);
}

/* Finish. IHELD(ND,N) = 1 for freedoms that the host moves by itself. X(ND,N) becomes the positions
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

/* The subroutine of a host that solves without contact: see EMSTEP. */
typedef void solver_77(const int *nu, const double *du, const int *irow, const int *icol,
                       const double *sec, const int *nc, double *cols, int *ierr);

typedef struct { solver_77 *solve; } bridge;

/* Call it, with the second derivatives counted from 1. */
static int solve_77(void *user, int n_freedom, const double *du, const emcon_csr *second,
                    int n_unknown, int n_column, double *columns)
{
   const int n_entry = second->row_start[n_unknown];
   int *place = malloc(sizeof(int)*((size_t)n_unknown + 1 + (size_t)n_entry)), i, status = 0;

   (void)n_freedom;
   if (!place) return EMCON_ERROR_ANALYSIS;
   for (i = 0; i <= n_unknown; i++) place[i] = second->row_start[i] + 1;
   for (i = 0; i < n_entry; i++) place[n_unknown + 1 + i] = second->column[i] + 1;
   ((bridge *)user)->solve(&n_unknown, du, place, place + n_unknown + 1, second->value, &n_column,
                           columns, &status);
   free(place);
   return status;
}

/* A whole step from U0(ND,N). DU(ND,N): the motion that is expected, which becomes that of the step;
 * REST(ND,N): the motion with which all velocities end at 0. IACT(M): contacts that acted before,
 * which become those that act now; ALAM(M): their forces. EXTERNAL SOLVE is
 *
 *    SUBROUTINE SOLVE(NU, DU, IROW, ICOL, SEC, NC, COLS, IERR)
 *
 * For the NU = ND N freedoms it finds the residual of the motion DU without contact, and adds it to
 * COLS(I,NC); it finds the derivative K of the residual, and subtracts the sparse matrix IROW, ICOL,
 * SEC (row I has the entries IROW(I) to IROW(I+1)-1); it replaces each of the NC columns of
 * COLS(NU,NC) by K**-1 times it, with 0 for freedoms that are held. IERR, 0 before, ends the step. */
void emstep_(const int *ih, const int *n, const int *m, const double *u0, double *du,
             const double *rest, int *iact, double *alam, solver_77 *solve, int *ierr)
{
   bridge to = {NULL};

   to.solve = solve;
   *ierr = emcon_solve_step(model_of(ih), *n, u0, du, rest, 0, *m, iact, alam, solve_77, &to);
}

/* The energy that friction dissipates in the step that was solved last, of M contacts. */
void emloss_(const int *ih, const int *m, double *loss, int *ierr)
{
   double *slip = room(*m, 2, sizeof *slip), *friction = room(*m, 2, sizeof *friction);
   int *way = room(*m, 1, sizeof *way), i;
   emcon_sizes sizes;

   *loss = 0;
   *ierr = emcon_get_slips(model_of(ih), *m, way, slip, friction);
   if (*ierr == EMCON_OK) *ierr = emcon_get_sizes(model_of(ih), &sizes);
   for (i = 0; *ierr == EMCON_OK && slip && friction && i < *m*sizes.n_slip; i++)
      *loss += slip[i]*friction[i];
   free(way);
   free(slip);
   free(friction);
}

/* Begin a step from U0(ND,N) by DU(ND,N). IWAS(M): contacts that acted before; IACT(M): those that
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
   emcon_gap *gap = room(*m, 1, sizeof *gap);
   int i;

   *ierr = gap ? emcon_get_gaps(model_of(ih), *n, u0, du, *m, gap) : EMCON_ERROR_INPUT;
   for (i = 0; *ierr == EMCON_OK && i < *m; i++) {
      near[i] = gap[i].is_near;
      g0[i] = gap[i].gap0;
      g1[i] = gap[i].gap1;
   }
   free(gap);
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
 * over ND N freedoms; DEFECT(K) is to become 0, DGAP(K) is the change of the gap. */
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

/* Sum of ALAM(I) times the derivative of row I of G by the motion, ND N rows. */
void emcurv_(const int *ih, const int *k, const double *alam, const int *maxnz, int *nz, int *irow,
             int *icol, double *val, int *ierr)
{
   emcon_csr matrix;

   *ierr = emcon_curvature(model_of(ih), *k, alam, &matrix);
   if (*ierr == EMCON_OK) *ierr = copy_matrix(&matrix, *maxnz, nz, irow, icol, val);
}

/* The next set IACT(M) after the step was solved with the selected one; IDONE = 1: it stands, or
 * ISTAT is not 0 and the step cannot be ended. AMAG(ND,N): sums of |contributions| to the
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
