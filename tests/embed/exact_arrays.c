/* Arrays of exactly the size that the header tells, through conditions that change in between: no
 * byte before or behind them may be touched (run under valgrind), and counts that do not fit are
 * refused.
 *
 * usage: exact_arrays DECK, whose free node 1 ... N are found by emcon_unknowns */
#include <emcon.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static emcon_model *m;
static emcon_sizes sizes;

static void need(int is_met, const char *what)
{
   if (is_met) return;
   fprintf(stderr, "%s: %s\n", what, emcon_message(m));
   exit(1);
}

#define WORKS(call) need((call) == EMCON_OK, #call)
#define REFUSED(call) need((call) == EMCON_ERROR_INPUT, #call)

static double *numbers(int n)
{
   double *array = malloc((size_t)(n > 0 ? n : 1)*sizeof *array);
   for (int i = 0; i < n; ++i) array[i] = 0;
   return array;
}

/* The residual of an evaluation that was made before the unknowns changed is not there any more. */
static void stale(void)
{
   emcon_csr a, b;
   WORKS(emcon_get_sizes(m, &sizes));
   double *nodal = numbers(sizes.n_dim*sizes.n_node), *unknown = numbers(sizes.n_unknown),
          *lam = numbers(sizes.n_constraint);
   REFUSED(emcon_residual(m, 1, sizes.n_node, nodal, sizes.n_unknown, unknown));
   REFUSED(emcon_tangent(m, 1, &a));
   REFUSED(emcon_null_space(m, &a, &b, NULL, NULL));
   REFUSED(emcon_multipliers(m, 0, NULL, sizes.n_constraint, lam));
   free(nodal);
   free(unknown);
   free(lam);
}

static void evaluate(void)
{
   emcon_csr a, b;
   emcon_constraint_report report;
   WORKS(emcon_get_sizes(m, &sizes));
   const int n = sizes.n_node, nc = sizes.n_constraint;
   double *u1 = numbers(sizes.n_dim*n), *nodal = numbers(sizes.n_dim*n), *unknown = numbers(sizes.n_unknown),
          *lam = numbers(nc);
   int *active = calloc((size_t)nc + 1, sizeof *active);
   WORKS(emcon_guess(m, 1e-3, n, u1));
   WORKS(emcon_evaluate(m, 1e-3, n, u1, 1, 0, NULL, NULL));
   WORKS(emcon_residual(m, 1, n, nodal, sizes.n_unknown, unknown));
   WORKS(emcon_tangent(m, 1, &a));
   WORKS(emcon_null_space(m, &a, &b, NULL, NULL));
   WORKS(emcon_multipliers(m, 0, NULL, nc, lam));
   WORKS(emcon_evaluate(m, 1e-3, n, u1, 0, nc, lam, active));
   REFUSED(emcon_evaluate(m, 1e-3, n + 1, u1, 0, 0, NULL, NULL));
   REFUSED(emcon_evaluate(m, 1e-3, n, u1, 0, nc + 1, lam, NULL));
   REFUSED(emcon_evaluate(m, 1e-3, n, u1, 0, nc + 1, NULL, active));
   WORKS(emcon_constraints(m, n, u1, u1, 0, &report));
   double *factor = numbers(report.n);
   WORKS(emcon_curvature_times(m, report.n, factor, n, u1, nodal));
   REFUSED(emcon_curvature_times(m, report.n + 1000000, factor, n, u1, nodal));
   REFUSED(emcon_curvature_times(m, -1, factor, n, u1, nodal));
   REFUSED(emcon_curvature_times(m, report.n, factor, n + 1000000, u1, nodal));
   WORKS(emcon_evaluate(m, 1e-3, n, u1, 1, 0, NULL, NULL));
   REFUSED(emcon_residual(m, 1, n - 1, nodal, 0, NULL));
   REFUSED(emcon_residual(m, 1, 0, NULL, sizes.n_unknown + 1, unknown));
   free(u1);
   free(nodal);
   free(unknown);
   free(lam);
   free(factor);
   free(active);
}

/* Pressures, gaps and node sets; a count that does not fit, and a set that there is not. */
static void ask(void)
{
   const int n = sizes.n_contact;
   double *pressure = numbers(n), *gap = numbers(n);
   int *is_in = calloc((size_t)sizes.n_node, sizeof *is_in);
   const char *notes = NULL;
   WORKS(emcon_get_pressures(m, n, pressure, gap));
   WORKS(emcon_get_pressures(m, n, NULL, gap));
   REFUSED(emcon_get_pressures(m, n + 1, pressure, gap));
   double *shear = numbers(sizes.n_slip*n), *slip = numbers(sizes.n_slip*n);
   WORKS(emcon_get_friction(m, n, shear, NULL, slip, NULL));
   REFUSED(emcon_get_friction(m, n - 1, shear, NULL, slip, NULL));
   free(shear);
   free(slip);
   WORKS(emcon_get_pair_friction(m, sizes.n_pair, NULL));
   REFUSED(emcon_find_nodes(m, "no such set", sizes.n_node, is_in));
   need(strstr(emcon_message(m), "no such set") != NULL, "the message names the set");
   REFUSED(emcon_find_nodes(m, "FLOOR", sizes.n_node - 1, is_in));
   REFUSED(emcon_find_nodes(m, NULL, sizes.n_node, is_in));
   WORKS(emcon_get_notes(m, &notes));
   WORKS(emcon_get_report(m, &notes));
   need(notes != NULL, "notes");
   free(pressure);
   free(gap);
   free(is_in);
}

/* Mesh, sets, bodies, fields: arrays of exactly their size, and what there is not. */
static void look(void)
{
   const int n = sizes.n_element;
   const size_t size = (size_t)n;
   int *label = calloc(size, sizeof *label), *kind = calloc(size, sizeof *kind);
   int *node = calloc(20*size, sizeof *node), *face = calloc(6*size, sizeof *face);
   int *body = calloc((size_t)sizes.n_node, sizeof *body);
   int n_place = -1, n_component = -1;
   const double *value = NULL;
   const char *text = NULL;
   double fraction = -1, t_end = -1;
   WORKS(emcon_get_elements(m, n, label, kind, node));
   need(node[0] >= 0 && node[19] == -1 && kind[0] == (sizes.n_dim == 2 ? 9 : 12), "an element");
   WORKS(emcon_get_elements(m, n, NULL, NULL, node));
   REFUSED(emcon_get_elements(m, n + 1, label, kind, node));
   WORKS(emcon_get_bodies(m, sizes.n_node, body));
   need(body[node[0]] >= 0 && body[node[0]] < sizes.n_body, "its body");
   double *momenta = numbers(sizes.n_momentum*sizes.n_body);
   double *x = numbers(sizes.n_dim*sizes.n_node), *u = numbers(sizes.n_dim*sizes.n_node);
   WORKS(emcon_get_momenta(m, sizes.n_body, momenta));
   WORKS(emcon_get_positions(m, sizes.n_node, x));
   WORKS(emcon_get_state(m, sizes.n_node, u, x));
   WORKS(emcon_set_state(m, sizes.n_node, u, x, 0, NULL, NULL, NULL));
   WORKS(emcon_gather(m, sizes.n_node, u));
   double *total = numbers(sizes.n_pair_total*sizes.n_pair);
   int *active = calloc((size_t)sizes.n_pair + 1, sizeof *active);
   need(sizes.n_pair_total == (sizes.n_dim == 2 ? 7 : 13), "figures of a pair");
   WORKS(emcon_get_pairs(m, sizes.n_pair, total, active));
   REFUSED(emcon_get_pairs(m, sizes.n_pair + 1, total, active));
   free(total);
   free(active);
   free(momenta);
   free(x);
   free(u);
   REFUSED(emcon_get_bodies(m, sizes.n_node - 1, body));
   REFUSED(emcon_find_elements(m, "no such set", n, label));
   REFUSED(emcon_find_faces(m, "no such surface", n, face));
   REFUSED(emcon_find_faces(m, NULL, n, face));
   WORKS(emcon_get_names(m, &text));
   need(text && strstr(text, "node set ") && strstr(text, "surface "), "names");
   WORKS(emcon_get_field(m, "s", &n_place, &n_component, &value));
   need(n_place == sizes.n_node && n_component == 7 && value[7*n_place - 1] >= 0, "stress");
   WORKS(emcon_get_field(m, "ENER", &n_place, &n_component, &value));
   need(n_place == n && n_component == 1 && value[n - 1] >= 0, "strain energy");
   WORKS(emcon_get_field(m, "U", NULL, NULL, NULL));
   REFUSED(emcon_get_field(m, "SS", &n_place, &n_component, &value));
   need(n_place == 0 && value == NULL, "nothing where there is none");
   REFUSED(emcon_get_field(m, NULL, &n_place, &n_component, &value));
   WORKS(emcon_get_progress(m, &fraction, &t_end));
   need(fraction >= 0 && fraction <= 1 && t_end > 0, "progress");
   need(emcon_record(m, "no/such/folder/run") == EMCON_ERROR_FILE, "a folder that is not there");
   WORKS(emcon_end_record(m));                  /* of nothing */
   free(label);
   free(kind);
   free(node);
   free(face);
   free(body);
}

/* Kernels: along a straight edge the gap is what the slave moves across it, and a linear law gives
 * half its stress times the strain; derivatives go along rows. */
static void kernels(void)
{
   const double x0[10] = {0.5, -1, 0, 0, 1, 0, 0, 0, 0, 0}, dx[10] = {0, 0.25};
   const double constant[2] = {2, 0}, none[3] = {0, 0, 0}, strain[3] = {1, 0, 0};
   double *gap = numbers(3), *g = numbers(10), *c = numbers(10), *h = numbers(100);
   double *stress = numbers(3), *tangent = numbers(9), energy = 0;
   WORKS(emcon_node_gap(x0, dx, 0, 0, 0, gap, g, c, h));
   need(gap[0] == 1 && gap[1] == 0.75 && gap[2] == -0.25 && g[1] == -1 && c[1] == -1, "gap");
   const char *linear = "linear\nELASTIC\n\n E nu";
   const int n_text = (int)strlen(linear) + 1;
   char *text = malloc((size_t)n_text);
   int law = 0;
   WORKS(emcon_get_law(0, &law, n_text, text));
   need(strcmp(text, linear) == 0, "the first law");
   REFUSED(emcon_get_law(0, &law, n_text - 1, text));
   REFUSED(emcon_get_law(1000, &law, n_text, text));
   REFUSED(emcon_get_law(-1, &law, n_text, text));
   free(text);
   const char *nts = "formulation\nNODE TO SURFACE\nEMCON_NODE_TO_SEGMENT\nnode to segment"
                     "\nplane axial space\n";
   const int n_nts = (int)strlen(nts) + 1;
   text = malloc((size_t)n_nts);
   int code = 0, is_default = 0;
   WORKS(emcon_get_option(0, &code, &is_default, n_nts, text));
   need(strcmp(text, nts) == 0 && code == 1 && is_default == 1, "the first option");
   REFUSED(emcon_get_option(0, &code, &is_default, n_nts - 1, text));
   REFUSED(emcon_get_option(1000, &code, &is_default, n_nts, text));
   REFUSED(emcon_get_option(-1, &code, &is_default, n_nts, text));
   free(text);
   WORKS(emcon_law_response(law, 2, constant, none, strain, &energy, stress, tangent));
   need(energy == 1 && stress[0] == 1 && tangent[0] == 1 && tangent[1] == 0, "law");
   REFUSED(emcon_law_response(99, 2, constant, none, strain, &energy, stress, tangent));
   free(gap);
   free(g);
   free(c);
   free(h);
   free(stress);
   free(tangent);
}

int main(int argc, char **argv)
{
   if (argc < 2) return 2;
   WORKS(emcon_open(argv[1], NULL, 0, &m));
   WORKS(emcon_get_sizes(m, &sizes));
   evaluate();
   ask();
   look();
   kernels();
   int *label = calloc((size_t)sizes.n_node, sizeof *label),
       *unknown = calloc((size_t)sizes.n_dim*(size_t)sizes.n_node, sizeof *unknown);
   WORKS(emcon_get_labels(m, sizes.n_node, label));
   WORKS(emcon_unknowns(m, sizes.n_node, unknown));
   const int n_dim = sizes.n_dim;
   int n_changed = 0, changed[3];
   for (int d = 0; d < n_dim*sizes.n_node && n_changed < 3; ++d) {
      if (unknown[d] < 0) continue;
      WORKS(emcon_prescribe(m, label[d/n_dim], d%n_dim + 1, 0));
      changed[n_changed++] = d;
      stale();
      evaluate();
      WORKS(emcon_prescribe(m, label[d/n_dim], d%n_dim + 1, 1e-9));
      REFUSED(emcon_add_prescribed(m, label[d/n_dim], d%n_dim + 1, 0));
   }
   WORKS(emcon_step(m, 1e-3, NULL));
   evaluate();
   for (int i = 0; i < n_changed; ++i) {
      WORKS(emcon_remove_prescribed(m, label[changed[i]/n_dim], changed[i]%n_dim + 1));
      stale();
      evaluate();
   }
   WORKS(emcon_step(m, 1e-3, NULL));
   printf("%d\n", n_changed);
   free(label);
   free(unknown);
   emcon_close(m);
   return 0;
}
