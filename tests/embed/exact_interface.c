/* Arrays of exactly the size that a model of a host's nodes tells: no byte before or behind them
 * may be touched (run under valgrind), and counts that do not fit are refused before any array is
 * touched, however large they are. */
#include <emcon.h>

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

static emcon_model *face;

#define WORKS(call) \
   do if ((call) != EMCON_OK) need(0, #call, emcon_message(face)); while (0)
#define REFUSED(call) need((call) == EMCON_ERROR_INPUT, #call, "not refused")
#define REFUSED_ALL(n, call) \
   for (int i_ = 0; i_ < n_wrong; ++i_) { const int n = wrong[i_]; REFUSED(call); }

static void refuse_to_build(double *x)
{
   REFUSED(emcon_new(INT_MAX, 2, x, NULL));
   for (int i = 0; i < n_wrong; ++i) {
      if (wrong[i] == 1000) continue;                    /* that is a number of nodes */
      REFUSED(emcon_new(wrong[i], 2, wrong[i] > 0 ? NULL : x, &face));
      emcon_close(face);
   }
}

static void build(int formulation, double friction)
{
   emcon_pair_options options = {0};
   double *x = numbers(2*n_node);
   int *edge = integers(6, 0), *held = integers(2*n_node, 0), surface[4];
   for (int i = 0; i < 2*n_node; ++i) x[i] = scene[i];
   refuse_to_build(x);
   WORKS(emcon_new(n_node, 2, x, &face));
   for (int i = 0; i < 6; ++i) edge[i] = lower[i];
   WORKS(emcon_add_surface(face, "lower", 3, edge, &surface[0]));
   WORKS(emcon_add_surface(face, NULL, 2, upper, &surface[1]));
   WORKS(emcon_add_surface(face, "base", 1, base, &surface[2]));
   WORKS(emcon_add_surface(face, "glued", 1, glued, &surface[3]));
   REFUSED(emcon_add_surface(face, "none", INT_MAX, NULL, NULL));
   REFUSED(emcon_add_surface(face, "none", INT_MIN, edge, NULL));
   REFUSED(emcon_add_faces(face, "none", INT_MAX, NULL, NULL, 1, edge, NULL));
   REFUSED(emcon_add_faces(face, "none", 1, edge, edge, INT_MIN, edge, NULL));
   REFUSED_ALL(n, emcon_add_pair(face, n, surface[0], formulation, NULL));
   options.friction = friction;
   WORKS(emcon_add_pair(face, surface[1], surface[0], formulation, friction > 0 ? &options : NULL));
   WORKS(emcon_add_tie(face, surface[3], surface[2], EMCON_DUAL, -1));
   REFUSED(emcon_set_contact(face, NULL));
   REFUSED_ALL(n, emcon_hold(face, n, held));
   held[0] = 1;
   WORKS(emcon_hold(face, n_node, held));
   WORKS(emcon_build(face));
   WORKS(emcon_get_positions(face, n_node, x));
   WORKS(emcon_follow(face, n_node, x));
   WORKS(emcon_gather(face, n_node, x));
   REFUSED_ALL(n, emcon_follow(face, n, x));
   WORKS(emcon_get_sizes(face, NULL));
   free(x);
   free(edge);
   free(held);
}

static void eliminate(const emcon_sizes *sizes, int n)
{
   emcon_csr p, df;
   const int *redundant;
   const int m = sizes->n_constraint;
   int n_redundant;
   double *lam = numbers(m), *defect = numbers(n), *force = numbers(2*n_node),
          *motion = numbers(2*n_node), *row = numbers(n);
   WORKS(emcon_null_space(face, &p, &df, &n_redundant, &redundant));
   need(n_redundant == 0 && p.n_row == 2*n_node && p.n_column == sizes->n_unknown - n, "P", "size");
   WORKS(emcon_multipliers(face, n_node, force, m, lam));
   WORKS(emcon_row_multipliers(face, n_node, force, n, row));
   WORKS(emcon_particular(face, n, defect, n_node, motion));
   REFUSED_ALL(k, emcon_row_multipliers(face, n_node, force, k, row));
   REFUSED(emcon_multipliers(face, n_node, NULL, m, lam));
   REFUSED_ALL(k, emcon_multipliers(face, n_node, force, k, lam));
   REFUSED_ALL(k, emcon_multipliers(face, k, force, m, lam));
   REFUSED_ALL(k, emcon_particular(face, k, defect, n_node, motion));
   REFUSED_ALL(k, emcon_particular(face, n, defect, k, motion));
   free(lam);
   free(row);
   free(defect);
   free(force);
   free(motion);
}

static void differentiate(double *u0, double *du, int n, int m, int *active)
{
   emcon_csr curvature;
   double *lam = numbers(n), *product = numbers(2*n_node), *area = numbers(m),
          *length = numbers(m), *slip = numbers(m), *friction = numbers(m);
   int is_done, outcome, *way = integers(m, 0);
   WORKS(emcon_curvature(face, n, lam, &curvature));
   WORKS(emcon_curvature_times(face, n, lam, n_node, du, product));
   WORKS(emcon_get_areas(face, n_node, u0, m, area, length));
   REFUSED_ALL(k, emcon_curvature(face, k, lam, &curvature));
   REFUSED_ALL(k, emcon_curvature_times(face, k, lam, n_node, du, product));
   REFUSED_ALL(k, emcon_get_areas(face, n_node, u0, k, area, length));
   REFUSED_ALL(k, emcon_update_active(face, n_node, u0, du, k, lam, NULL, m, active, &is_done,
                                      &outcome));
   REFUSED_ALL(k, emcon_update_active(face, n_node, u0, du, n, lam, product, k, active, &is_done,
                                      &outcome));
   REFUSED_ALL(k, emcon_update_active(face, k, u0, du, n, lam, product, m, active, &is_done,
                                      &outcome));
   WORKS(emcon_update_active(face, n_node, u0, du, n, lam, product, m, active, &is_done, &outcome));
   WORKS(emcon_get_slips(face, m, way, slip, friction));
   WORKS(emcon_begin_damping(face, 0.1));
   WORKS(emcon_law_forces(face, n_node, product, length));
   REFUSED_ALL(k, emcon_law_forces(face, k, product, length));
   REFUSED_ALL(k, emcon_get_slips(face, k, way, slip, friction));
   free(way);
   free(slip);
   free(friction);
   free(lam);
   free(product);
   free(area);
   free(length);
}

static void condense(double *u0, double *du, int m, const int *active)
{
   int n;
   WORKS(emcon_select_candidates(face, n_node, u0, du, m, active, &n));
   REFUSED_ALL(k, emcon_select_candidates(face, n_node, u0, du, k, active, &n));
   WORKS(emcon_evaluate_contact(face, n_node, u0, du, NULL));
   double *w = numbers(n*n), *opening = numbers(n), *lam = numbers(n);
   for (int i = 0; i < n; ++i) w[(n + 1)*i] = opening[i] = 1;
   WORKS(emcon_solve_contacts(face, n, w, opening, lam));
   emcon_csr pattern;
   WORKS(emcon_pattern(face, n_node, u0, du, &pattern));
   need(pattern.n_row == 2*n_node && pattern.n_column == 2*n_node, "emcon_pattern", "its size");
   REFUSED_ALL(k, emcon_pattern(face, k, u0, du, &pattern));
   need(lam[0] == 0, "emcon_solve_contacts", "what opens pushes");
   REFUSED_ALL(k, emcon_solve_contacts(face, k, w, opening, lam));
   free(w);
   free(opening);
   free(lam);
}

/* Equations without forces, K = 1, by the unknowns of the links: nothing moves. Reads and writes all. */
static int stay(void *user, int n_freedom, const double *du, const emcon_csr *second, int n_unknown,
                int n_column, double *columns)
{
   for (int i = 0; i < n_freedom; ++i) *(double *)user += du[i];
   for (int i = 0; i < second->row_start[n_unknown]; ++i) *(double *)user += second->value[i];
   for (int i = 0; i < n_column*n_unknown; ++i) columns[i] *= 1;
   return second->n_row != n_unknown || second->n_column != n_unknown || n_freedom != 2*n_node;
}

static int fail(void *user, int n_freedom, const double *du, const emcon_csr *second, int n_unknown,
                int n_column, double *columns)
{
   (void)user, (void)n_freedom, (void)du, (void)second, (void)n_unknown, (void)n_column, (void)columns;
   return 1;
}

static void solve_at_once(const emcon_sizes *sizes)
{
   const int m = sizes->n_constraint;
   double *u0 = numbers(2*n_node), *du = numbers(2*n_node), *lam = numbers(m), sum = 0;
   int *active = integers(m, 0);
   emcon_csr links;

   REFUSED(emcon_solve_step(face, n_node, u0, du, NULL, 0, m, active, lam, stay, &sum));    /* tied */
   WORKS(emcon_links(face, &links));
   WORKS(emcon_set_map(face, &links));
   WORKS(emcon_solve_step(face, n_node, u0, du, NULL, 0, m, active, lam, stay, &sum));
   WORKS(emcon_solve_step(face, n_node, u0, du, u0, 0.1, m, active, NULL, stay, &sum));
   need(!sum, "emcon_solve_step", "something has moved");
   need(emcon_solve_step(face, n_node, u0, du, u0, 0, m, active, lam, fail, NULL) == EMCON_ERROR_ANALYSIS,
        "emcon_solve_step", "a function that fails");
   REFUSED(emcon_solve_step(face, n_node, u0, du, u0, 0, m, active, lam, NULL, NULL));
   REFUSED(emcon_solve_step(face, n_node, u0, NULL, u0, 0, m, active, lam, stay, &sum));
   REFUSED(emcon_solve_step(face, n_node, u0, du, u0, -1, m, active, lam, stay, &sum));
   REFUSED_ALL(k, emcon_solve_step(face, k, u0, du, u0, 0, m, active, lam, stay, &sum));
   REFUSED_ALL(k, emcon_solve_step(face, n_node, u0, du, u0, 0, k, active, lam, stay, &sum));
   free(u0);
   free(du);
   free(lam);
   free(active);
}

static void step(int has_friction)
{
   emcon_sizes sizes;
   emcon_constraint_report values;
   WORKS(emcon_get_sizes(face, &sizes));
   const int m = sizes.n_constraint, n_contact = sizes.n_contact, n_row = m - n_contact;
   double *u0 = numbers(2*n_node), *du = numbers(2*n_node), depth;
   int *active = integers(m, 0), *node = integers(m, 0), *pair = integers(m, 0), n, behind;
   emcon_gap *gap = malloc((size_t)m*sizeof *gap);
   need(n_contact == 3 && n_row == 4 && sizes.n_unknown == 2*(n_node - 2) - n_held, "sizes",
        "not those of the scene");
   WORKS(emcon_get_contact(face, n_contact, NULL, NULL, node, pair));
   WORKS(emcon_begin_contact(face, n_node, u0, du, m, active, active));
   WORKS(emcon_begin_friction(face, n_node, du));
   REFUSED_ALL(k, emcon_begin_friction(face, k, du));
   WORKS(emcon_get_gaps(face, n_node, u0, du, m, gap));
   WORKS(emcon_overlap(face, n_node, u0, du, &depth, &behind));
   need(depth == 0 && behind == -1, "emcon_overlap", "there is none");
   REFUSED_ALL(k, emcon_begin_contact(face, n_node, u0, du, k, active, active));
   REFUSED_ALL(k, emcon_get_gaps(face, n_node, u0, du, k, gap));
   REFUSED_ALL(k, emcon_get_gaps(face, k, u0, du, m, gap));
   for (int i = 0; i < m; ++i) active[i] = gap[i].is_near;
   WORKS(emcon_select(face, n_node, u0, du, m, active, &n));
   REFUSED_ALL(k, emcon_select(face, n_node, u0, du, k, active, &n));
   need(n == (has_friction ? 2 : 1)*n_contact, "emcon_select", "a contact is not near");
   REFUSED(emcon_null_space(face, NULL, NULL, NULL, NULL));
   WORKS(emcon_evaluate_contact(face, n_node, u0, du, &values));
   WORKS(emcon_evaluate_contact(face, n_node, u0, du, NULL));
   eliminate(&sizes, n);
   condense(u0, du, m, active);
   WORKS(emcon_select(face, n_node, u0, du, m, active, &n));
   WORKS(emcon_evaluate_contact(face, n_node, u0, du, &values));
   differentiate(u0, du, n, m, active);
   WORKS(emcon_begin_contact(face, n_node, u0, du, m, active, active));
   for (int i = n_row; i < m; ++i) active[i] = 1;
   WORKS(emcon_select(face, n_node, u0, du, m, active, &n));
   node[0] = 2;
   REFUSED_ALL(k, emcon_drop(face, 1, node, k, active));
   REFUSED(emcon_drop(face, INT_MAX, NULL, m, active));
   WORKS(emcon_drop(face, 1, node, m, active));
   need(active[n_row] == 1 && active[m - 1] == 0, "emcon_drop", "another one is left");
   solve_at_once(&sizes);
   free(u0);
   free(du);
   free(active);
   free(node);
   free(pair);
   free(gap);
}

int main(void)
{
   for (int formulation = EMCON_NODE_TO_SEGMENT; formulation <= EMCON_MORTAR; ++formulation) {
      for (int has_friction = 0; has_friction < 2; ++has_friction) {
         build(formulation, 0.3*has_friction);
         step(has_friction);
         emcon_close(face);
      }
   }
   puts("done");
   return 0;
}
