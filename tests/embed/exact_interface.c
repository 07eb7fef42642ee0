/* Arrays of exactly the size that the interface tells, at the functions of emcon_interface.h and of
 * the Fortran 77 subroutines: no byte before or behind them may be touched (run under valgrind),
 * and counts that do not fit are refused before any array is touched, however large they are. */
#include <emcon_interface.h>

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>

static void need(int is_met, const char *what, const char *why)
{
   if (is_met) return;
   fprintf(stderr, "%s: %s\n", what, why);
   exit(1);
}

static double *numbers(int n)
{
   double *array = malloc((size_t)(n > 0 ? n : 1)*sizeof *array);
   for (int i = 0; i < n; ++i) array[i] = 0;
   return array;
}

static int *integers(int n, int value)
{
   int *array = malloc((size_t)(n > 0 ? n : 1)*sizeof *array);
   for (int i = 0; i < n; ++i) array[i] = value;
   return array;
}

/* Counts that are none of those of the scene; arrays of that size are not there. */
static const int wrong[] = {INT_MAX, INT_MAX/2 + 1, 1000, -1, INT_MIN};
enum { n_wrong = sizeof wrong/sizeof *wrong, n_node = 11, n_held = 1 };

/* Three nodes above the middles of the three edges of four, and two pairs of tied nodes. */
static const double scene[2*n_node] = {0, 0, 1, 0, 2, 0, 3, 0, .5, .01, 1.5, .01, 2.5, .01,
                                       0, -5, 1, -5, 0, -5, 1, -5};
static const int lower[] = {3, 2, 2, 1, 1, 0}, upper[] = {4, 5, 5, 6}, base[] = {8, 7},
                 glued[] = {9, 10};

/* ---- C --------------------------------------------------------------------------------------- */

static emcon_interface *face;

#define WORKS(call) \
   do if ((call) != EMCON_OK) need(0, #call, emcon_interface_message(face)); while (0)
#define REFUSED(call) need((call) == EMCON_ERROR_INPUT, #call, "not refused")
#define REFUSED_ALL(n, call) \
   for (int i_ = 0; i_ < n_wrong; ++i_) { const int n = wrong[i_]; REFUSED(call); }

static void refuse_to_build(double *x)
{
   REFUSED(emcon_interface_new(INT_MAX, x, NULL));
   for (int i = 0; i < n_wrong; ++i) {
      if (wrong[i] == 1000) continue;                    /* that is a number of nodes */
      REFUSED(emcon_interface_new(wrong[i], wrong[i] > 0 ? NULL : x, &face));
      emcon_interface_free(face);
   }
}

static void build(int formulation)
{
   double *x = numbers(2*n_node);
   int *edge = integers(6, 0), *held = integers(2*n_node, 0), surface[4];
   for (int i = 0; i < 2*n_node; ++i) x[i] = scene[i];
   refuse_to_build(x);
   WORKS(emcon_interface_new(n_node, x, &face));
   for (int i = 0; i < 6; ++i) edge[i] = lower[i];
   WORKS(emcon_interface_add_surface(face, "lower", 3, edge, &surface[0]));
   WORKS(emcon_interface_add_surface(face, NULL, 2, upper, &surface[1]));
   WORKS(emcon_interface_add_surface(face, "base", 1, base, &surface[2]));
   WORKS(emcon_interface_add_surface(face, "glued", 1, glued, &surface[3]));
   REFUSED(emcon_interface_add_surface(face, "none", INT_MAX, NULL, NULL));
   REFUSED(emcon_interface_add_surface(face, "none", INT_MIN, edge, NULL));
   REFUSED_ALL(n, emcon_interface_add_pair(face, n, surface[0], formulation, NULL));
   WORKS(emcon_interface_add_pair(face, surface[1], surface[0], formulation, NULL));
   WORKS(emcon_interface_add_tie(face, surface[3], surface[2], EMCON_DUAL, -1));
   REFUSED(emcon_interface_set(face, NULL));
   held[0] = 1;
   WORKS(emcon_interface_prepare(face, held));
   WORKS(emcon_interface_get_positions(face, x, NULL));
   WORKS(emcon_interface_follow(face, x));
   WORKS(emcon_interface_gather(face, x));
   WORKS(emcon_interface_get_sizes(face, NULL));
   free(x);
   free(edge);
   free(held);
}

static void eliminate(const emcon_interface_sizes *sizes, int n)
{
   emcon_csr p, df;
   const int *redundant;
   int n_redundant;
   double *lam = numbers(n), *defect = numbers(n), *force = numbers(sizes->n_unknown),
          *motion = numbers(sizes->n_unknown);
   WORKS(emcon_interface_get_null_space(face, &p, &df, &n_redundant, &redundant));
   need(n_redundant == 0 && p.n_row == sizes->n_unknown && p.n_column == p.n_row - n, "P", "size");
   WORKS(emcon_interface_multipliers(face, sizes->n_unknown, force, n, lam));
   WORKS(emcon_interface_particular(face, n, defect, sizes->n_unknown, motion));
   REFUSED_ALL(k, emcon_interface_multipliers(face, sizes->n_unknown, force, k, lam));
   REFUSED_ALL(k, emcon_interface_multipliers(face, k, force, n, lam));
   REFUSED_ALL(k, emcon_interface_particular(face, k, defect, sizes->n_unknown, motion));
   REFUSED_ALL(k, emcon_interface_particular(face, n, defect, k, motion));
   free(lam);
   free(defect);
   free(force);
   free(motion);
}

static void differentiate(double *u0, double *du, int n, int n_contact, int *active)
{
   emcon_csr curvature;
   double *lam = numbers(n), *product = numbers(2*n_node), *area = numbers(n_contact),
          *length = numbers(n_contact);
   int is_done, outcome;
   WORKS(emcon_interface_get_curvature(face, n, lam, &curvature));
   WORKS(emcon_interface_second_times(face, n, lam, du, product));
   WORKS(emcon_interface_get_areas(face, u0, n_contact, area, length));
   REFUSED_ALL(k, emcon_interface_get_curvature(face, k, lam, &curvature));
   REFUSED_ALL(k, emcon_interface_second_times(face, k, lam, du, product));
   REFUSED_ALL(k, emcon_interface_get_areas(face, u0, k, area, length));
   REFUSED_ALL(k, emcon_interface_update_active(face, u0, du, k, lam, NULL, n_contact, active,
                                                &is_done, &outcome));
   REFUSED_ALL(k, emcon_interface_update_active(face, u0, du, n, lam, product, k, active, &is_done,
                                                &outcome));
   WORKS(emcon_interface_update_active(face, u0, du, n, lam, product, n_contact, active, &is_done,
                                       &outcome));
   free(lam);
   free(product);
   free(area);
   free(length);
}

static void step(void)
{
   emcon_interface_sizes sizes;
   emcon_interface_constraints values;
   WORKS(emcon_interface_get_sizes(face, &sizes));
   const int m = sizes.n_contact;
   double *u0 = numbers(2*n_node), *du = numbers(2*n_node);
   int *active = integers(m, 0), *node = integers(m, 0), *pair = integers(m, 0), n;
   emcon_gap *gap = malloc((size_t)m*sizeof *gap);
   need(m == 3 && sizes.n_unknown == 2*(n_node - 2) - n_held, "sizes", "not those of the scene");
   WORKS(emcon_interface_get_contacts(face, m, node, pair));
   WORKS(emcon_interface_begin_step(face, u0, du, m, active, active));
   WORKS(emcon_interface_get_gaps(face, u0, du, m, gap));
   REFUSED_ALL(k, emcon_interface_get_contacts(face, k, node, pair));
   REFUSED_ALL(k, emcon_interface_begin_step(face, u0, du, k, active, active));
   REFUSED_ALL(k, emcon_interface_get_gaps(face, u0, du, k, gap));
   for (int i = 0; i < m; ++i) active[i] = gap[i].is_near;
   WORKS(emcon_interface_select(face, u0, du, m, active, &n));
   REFUSED_ALL(k, emcon_interface_select(face, u0, du, k, active, &n));
   need(n == m, "emcon_interface_select", "a contact is not near");
   REFUSED(emcon_interface_get_null_space(face, NULL, NULL, NULL, NULL));
   WORKS(emcon_interface_evaluate(face, u0, du, &values));
   WORKS(emcon_interface_evaluate(face, u0, du, NULL));
   eliminate(&sizes, n);
   differentiate(u0, du, n, m, active);
   WORKS(emcon_interface_begin_step(face, u0, du, m, active, active));
   for (int i = 0; i < m; ++i) active[i] = 1;
   WORKS(emcon_interface_select(face, u0, du, m, active, &n));
   node[0] = 2;
   REFUSED_ALL(k, emcon_interface_drop(face, 1, node, k, active));
   REFUSED(emcon_interface_drop(face, INT_MAX, NULL, m, active));
   WORKS(emcon_interface_drop(face, 1, node, m, active));
   need(active[0] == 1 && active[2] == 0, "emcon_interface_drop", "another one is left");
   free(u0);
   free(du);
   free(active);
   free(node);
   free(pair);
   free(gap);
}

/* ---- Fortran 77 ------------------------------------------------------------------------------ */

void emnew_(int *, const int *, const double *, int *);
void emsurf_(int *, const int *, const int *, int *, int *);
void empair_(int *, const int *, const int *, const int *, const int *, const double *, int *);
void emtie_(int *, const int *, const int *, const int *, const double *, int *);
void emprep_(int *, const int *, const int *, double *, int *, int *, double *, int *);
void emlink_(int *, const int *, const int *, int *, int *, int *, double *, int *);
void emfoll_(int *, const int *, double *, int *);
void embeg_(int *, const int *, const int *, const double *, const double *, const int *, int *,
            int *);
void emgap_(int *, const int *, const int *, const double *, const double *, int *, double *,
            double *, int *);
void emsel_(int *, const int *, const int *, const double *, const double *, const int *, int *,
            int *, double *, int *);
void emeval_(int *, const int *, const int *, const double *, const double *, const int *, int *,
             int *, int *, double *, double *, double *, double *, int *);
void emcurv_(int *, const int *, const double *, const int *, const int *, int *, int *, int *,
             double *, int *);
void emtime_(int *, const int *, const double *, const int *, const double *, double *, int *);
void emupd_(int *, const int *, const int *, const double *, const double *, const int *,
            const double *, const double *, int *, int *, int *, int *);
void emdrop_(int *, const int *, const int *, const int *, int *, int *);
void emnull_(int *, const int *, const int *, const int *, int *, int *, int *, double *, double *,
             int *, int *, int *);
void emlam_(int *, const int *, const double *, const int *, double *, int *);
void empart_(int *, const int *, const double *, const int *, double *, int *);
void emmsg_(int *, const int *, char *);
void emfree_(int *);

static int ih[3], ierr;

static void told(int is_met, const char *what)
{
   char text[201] = "";
   const int length = 200;
   if (!is_met) emmsg_(ih, &length, text);
   need(is_met, what, text);
}

#define DONE(call) do { call; told(ierr == 0, #call); } while (0)
#define TOLD(k, call) \
   for (int i_ = 0; i_ < n_wrong; ++i_) { const int k = wrong[i_]; call; told(ierr == 2, #call); }

static int surface_of(int n_edge, const int *edge)
{
   int *from_one = integers(2*n_edge, 0), number;
   for (int i = 0; i < 2*n_edge; ++i) from_one[i] = edge[i] + 1;
   DONE(emsurf_(ih, &n_edge, from_one, &number, &ierr));
   free(from_one);
   return number;
}

static void build_77(int formulation, int *m, int *nu)
{
   const int n = n_node, zero[5] = {0}, dual = EMCON_DUAL, room = 2*n_node;
   const double angle[2] = {0}, anywhere = -1;
   double *x = numbers(2*n_node), *val = numbers(room), move;
   int *held = integers(2*n_node, 0), *row = integers(2*n_node + 1, 0), *column = integers(room, 0),
       nz;
   for (int i = 0; i < 2*n_node; ++i) x[i] = scene[i];
   DONE(emnew_(ih, &n, x, &ierr));
   const int low = surface_of(3, lower), up = surface_of(2, upper), master = surface_of(1, base),
             slave = surface_of(1, glued);
   DONE(empair_(ih, &up, &low, &formulation, zero, angle, &ierr));
   DONE(emtie_(ih, &slave, &master, &dual, &anywhere, &ierr));
   held[0] = 1;
   TOLD(k, emprep_(ih, &k, held, x, m, nu, &move, &ierr));
   DONE(emprep_(ih, &n, held, x, m, nu, &move, &ierr));
   DONE(emlink_(ih, &n, &room, &nz, row, column, val, &ierr));
   TOLD(k, emlink_(ih, &k, &room, &nz, row, column, val, &ierr));
   DONE(emfoll_(ih, &n, x, &ierr));
   TOLD(k, emfoll_(ih, &k, x, &ierr));
   free(x);
   free(val);
   free(held);
   free(row);
   free(column);
}

/* The matrices of the selected contacts, with too little room and with as much as they need. */
static void matrices_77(int k, int nu, const double *u0, const double *du)
{
   const int n = n_node, none = 0;
   int *row = integers(2*n_node + 1, 0), *short_row = integers(k + 1, 0), nz, n_redundant,
       *redundant = integers(k, 0), *column = integers(0, 0), *unknown_row = integers(nu + 1, 0);
   double *lam = numbers(k), *defect = numbers(k), *change = numbers(k), *a = numbers(0),
          *b = numbers(0);
   emeval_(ih, &n, &k, u0, du, &none, &nz, short_row, column, a, b, defect, change, &ierr);
   told(ierr == 2 && nz > 0, "emeval without room");
   int room = nz;
   column = realloc(column, (size_t)room*sizeof *column);
   a = realloc(a, (size_t)room*sizeof *a);
   b = realloc(b, (size_t)room*sizeof *b);
   DONE(emeval_(ih, &n, &k, u0, du, &room, &nz, short_row, column, a, b, defect, change, &ierr));
   TOLD(i, emeval_(ih, &n, &i, u0, du, &room, &nz, short_row, column, a, b, defect, change, &ierr));
   TOLD(i, emeval_(ih, &i, &k, u0, du, &room, &nz, short_row, column, a, b, defect, change, &ierr));
   emcurv_(ih, &k, lam, &n, &none, &nz, row, column, a, &ierr);
   told(ierr == 2 && nz > 0, "emcurv without room");
   room = nz;
   column = realloc(column, (size_t)room*sizeof *column);
   a = realloc(a, (size_t)room*sizeof *a);
   DONE(emcurv_(ih, &k, lam, &n, &room, &nz, row, column, a, &ierr));
   TOLD(i, emcurv_(ih, &i, lam, &n, &room, &nz, row, column, a, &ierr));
   TOLD(i, emcurv_(ih, &k, lam, &i, &room, &nz, row, column, a, &ierr));
   emnull_(ih, &nu, &k, &none, &nz, unknown_row, column, a, b, &n_redundant, redundant, &ierr);
   told(ierr == 2 && nz > 0, "emnull without room");
   room = nz;
   column = realloc(column, (size_t)room*sizeof *column);
   a = realloc(a, (size_t)room*sizeof *a);
   b = realloc(b, (size_t)room*sizeof *b);
   DONE(emnull_(ih, &nu, &k, &room, &nz, unknown_row, column, a, b, &n_redundant, redundant,
                &ierr));
   TOLD(i, emnull_(ih, &i, &k, &room, &nz, unknown_row, column, a, b, &n_redundant, redundant,
                   &ierr));
   TOLD(i, emnull_(ih, &nu, &i, &room, &nz, unknown_row, column, a, b, &n_redundant, redundant,
                   &ierr));
   free(row);
   free(short_row);
   free(redundant);
   free(column);
   free(unknown_row);
   free(lam);
   free(defect);
   free(change);
   free(a);
   free(b);
}

static void vectors_77(int k, int m, int nu, const double *u0, const double *du, int *active)
{
   const int n = n_node, one = 1;
   double *lam = numbers(k), *force = numbers(nu), *motion = numbers(nu),
          *product = numbers(2*n_node);
   int *place = integers(1, 3), done, status;
   DONE(emlam_(ih, &nu, force, &k, lam, &ierr));
   TOLD(i, emlam_(ih, &i, force, &k, lam, &ierr));
   TOLD(i, emlam_(ih, &nu, force, &i, lam, &ierr));
   DONE(empart_(ih, &k, lam, &nu, motion, &ierr));
   TOLD(i, empart_(ih, &i, lam, &nu, motion, &ierr));
   TOLD(i, empart_(ih, &k, lam, &i, motion, &ierr));
   DONE(emtime_(ih, &k, lam, &n, du, product, &ierr));
   TOLD(i, emtime_(ih, &i, lam, &n, du, product, &ierr));
   TOLD(i, emtime_(ih, &k, lam, &i, du, product, &ierr));
   TOLD(i, emupd_(ih, &i, &m, u0, du, &k, lam, product, active, &done, &status, &ierr));
   TOLD(i, emupd_(ih, &n, &i, u0, du, &k, lam, product, active, &done, &status, &ierr));
   TOLD(i, emupd_(ih, &n, &m, u0, du, &i, lam, product, active, &done, &status, &ierr));
   TOLD(i, emdrop_(ih, &one, place, &i, active, &ierr));
   DONE(emdrop_(ih, &one, place, &m, active, &ierr));
   told(active[0] == 1 && active[2] == 0, "emdrop leaves another one");
   free(lam);
   free(force);
   free(motion);
   free(product);
   free(place);
}

static void step_77(int m, int nu)
{
   const int n = n_node;
   double *u0 = numbers(2*n_node), *du = numbers(2*n_node), *g0 = numbers(m), *g1 = numbers(m);
   int *was = integers(m, 0), *active = integers(m, 0), *id = integers(m, 0), k;
   DONE(embeg_(ih, &n, &m, u0, du, was, active, &ierr));
   TOLD(i, embeg_(ih, &i, &m, u0, du, was, active, &ierr));
   TOLD(i, embeg_(ih, &n, &i, u0, du, was, active, &ierr));
   DONE(emgap_(ih, &n, &m, u0, du, active, g0, g1, &ierr));
   TOLD(i, emgap_(ih, &i, &m, u0, du, active, g0, g1, &ierr));
   TOLD(i, emgap_(ih, &n, &i, u0, du, active, g0, g1, &ierr));
   DONE(emsel_(ih, &n, &m, u0, du, active, &k, id, g0, &ierr));
   TOLD(i, emsel_(ih, &i, &m, u0, du, active, &k, id, g0, &ierr));
   TOLD(i, emsel_(ih, &n, &i, u0, du, active, &k, id, g0, &ierr));
   DONE(emsel_(ih, &n, &m, u0, du, active, &k, id, g0, &ierr));
   told(k == m, "a contact is not near");
   matrices_77(k, nu, u0, du);
   vectors_77(k, m, nu, u0, du, active);
   free(u0);
   free(du);
   free(g0);
   free(g1);
   free(was);
   free(active);
   free(id);
}

int main(void)
{
   for (int formulation = EMCON_NODE_TO_SEGMENT; formulation <= EMCON_MORTAR; ++formulation) {
      int m, nu;
      build(formulation);
      step();
      emcon_interface_free(face);
      build_77(formulation, &m, &nu);
      step_77(m, nu);
      emfree_(ih);
   }
   puts("done");
   return 0;
}
