/* Wrong calls: each prints its name, the code and the message. After each the model has to work.
 *
 * usage: bad_calls DECK FOLDER; the deck has gravity on each element */
#include <emcon.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TELL(call) tell(#call, call)

static emcon_model *m;      /* that the messages are of */

static void tell(const char *call, int status)
{
   const char *text = status == EMCON_OK ? "" : emcon_message(m);

   printf("%.*s|%d|%s\n", (int)strcspn(call, "("), call, status, text ? text : "NULL");
}

/* All functions with nothing in place of the model. */
static void without_model(void)
{
   double x[2] = {0, 0};
   int i[2] = {0, 0}, faces[6], nodes[20];
   const double *values;
   emcon_csr matrix;
   emcon_sizes sizes;
   const char *json;
   emcon_ledger ledger;
   emcon_snapshot *snapshot;
   emcon_constraint_report report;
   emcon_contact_settings settings = {0};
   emcon_gap gap;

   TELL(emcon_open("none.inp", NULL, 0, NULL));
   TELL(emcon_read("none.inp", NULL, 0, NULL));
   TELL(emcon_read_text("*NODE", "none.inp", NULL, 0, NULL));
   TELL(emcon_read_passages("*NODE", 1, i, "none.inp", NULL, 0, NULL));
   TELL(emcon_load("none.h5", NULL));
   TELL(emcon_resume(m, "none.h5"));
   TELL(emcon_give_law(m, "M", NULL, NULL));
   TELL(emcon_give_potential(m, NULL, 1, i, NULL, NULL));
   TELL(emcon_give_force(m, NULL, NULL, NULL, NULL));
   TELL(emcon_give_mass(m, NULL));
   TELL(emcon_build(m));
   TELL(emcon_set_threads(m, 1));
   TELL(emcon_advance(m, NULL));
   TELL(emcon_is_done(m) - 1 + EMCON_ERROR_INPUT);
   TELL(emcon_run(m, 1, NULL, NULL, NULL));
   TELL(emcon_step(m, 1, NULL));
   TELL(emcon_next_step(m));
   TELL(emcon_set_state(m, 1, x, x, 1, x, i, x));
   TELL(emcon_take_snapshot(m, &snapshot));
   TELL(emcon_restore_snapshot(m, NULL));
   TELL(emcon_save(m, "none.h5"));
   TELL(emcon_get_sizes(m, &sizes));
   TELL(emcon_get_time(m, x));
   TELL(emcon_get_ledger(m, &ledger));
   TELL(emcon_get_verdict(m, i, &json));
   TELL(emcon_get_notes(m, &json));
   TELL(emcon_get_report(m, &json));
   TELL(emcon_find_nodes(m, "ALL", 1, i));
   TELL(emcon_find_elements(m, "ALL", 1, i));
   TELL(emcon_find_faces(m, "TOP", 1, faces));
   TELL(emcon_get_names(m, &json));
   TELL(emcon_get_elements(m, 1, i, i, nodes));
   TELL(emcon_get_bodies(m, 1, i));
   TELL(emcon_get_field(m, "U", i, i, &values));
   TELL(emcon_get_progress(m, x, x));
   TELL(emcon_record(m, "none"));
   TELL(emcon_end_record(m));
   TELL(emcon_get_labels(m, 1, i));
   TELL(emcon_get_positions(m, 1, x));
   TELL(emcon_get_state(m, 1, x, x));
   TELL(emcon_get_multipliers(m, 1, x, i));
   TELL(emcon_get_contact(m, 1, x, i, i, i));
   TELL(emcon_get_pressures(m, 1, x, x));
   TELL(emcon_get_friction(m, 1, x, NULL, x, x));
   TELL(emcon_get_pair_friction(m, 1, x));
   TELL(emcon_get_pairs(m, 1, x, i));
   TELL(emcon_get_momenta(m, 1, x));
   TELL(emcon_find_load(m, EMCON_LOAD_POINT, 1, 1, i));
   TELL(emcon_set_load(m, 0, 1));
   TELL(emcon_add_loads(m, EMCON_LOAD_POINT, 1, i, i, x, NULL));
   TELL(emcon_set_prescribed(m, 1, 1, 0));
   TELL(emcon_add_prescribed(m, 1, 1, 0));
   TELL(emcon_prescribe(m, 1, 1, 0));
   TELL(emcon_remove_prescribed(m, 1, 1));
   TELL(emcon_unknowns(m, 1, i));
   TELL(emcon_links(m, &matrix));
   TELL(emcon_mass(m, &matrix));
   TELL(emcon_guess(m, 1, 1, x));
   TELL(emcon_evaluate(m, 1, 1, x, 1, 1, x, i));
   TELL(emcon_residual(m, 1, 1, x, 1, x));
   TELL(emcon_tangent(m, 1, &matrix));
   TELL(emcon_null_space(m, &matrix, &matrix, NULL, NULL));
   TELL(emcon_multipliers(m, 1, x, 1, x));
   TELL(emcon_row_multipliers(m, 1, x, 1, x));
   TELL(emcon_particular(m, 1, x, 1, x));
   TELL(emcon_curvature(m, 1, x, &matrix));
   TELL(emcon_follow(m, 1, x));
   TELL(emcon_gather(m, 1, x));
   TELL(emcon_get_tie_matrices(m, 0, &matrix, &matrix));
   TELL(emcon_new(1, 2, x, NULL));
   TELL(emcon_add_surface(m, NULL, 1, i, i));
   TELL(emcon_add_faces(m, NULL, 1, i, i, 1, i, i));
   TELL(emcon_add_pair(m, 0, 1, EMCON_MORTAR, NULL));
   TELL(emcon_add_tie(m, 0, 1, EMCON_DUAL, -1));
   TELL(emcon_hold(m, 1, i));
   TELL(emcon_set_contact(m, &settings));
   TELL(emcon_begin_contact(m, 1, x, x, 1, i, i));
   TELL(emcon_begin_friction(m, 1, x));
   TELL(emcon_set_map(m, &matrix));
   TELL(emcon_pattern(m, 1, x, x, &matrix));
   TELL(emcon_begin_damping(m, 1));
   TELL(emcon_law_forces(m, 1, x, x));
   TELL(emcon_get_slips(m, 1, i, x, x));
   TELL(emcon_get_gaps(m, 1, x, x, 1, &gap));
   TELL(emcon_select(m, 1, x, x, 1, i, i));
   TELL(emcon_choose(m, 1, x, x, 1, i, x));
   TELL(emcon_select_candidates(m, 1, x, x, 1, i, i));
   TELL(emcon_solve_contacts(m, 1, x, x, x));
   TELL(emcon_solve_step(m, 1, x, x, x, 0, 1, i, x, NULL, NULL));
   TELL(emcon_evaluate_contact(m, 1, x, x, &report));
   TELL(emcon_update_active(m, 1, x, x, 1, x, x, 1, i, i, i));
   TELL(emcon_drop(m, 1, i, 1, i));
   TELL(emcon_get_areas(m, 1, x, 1, x, x));
   TELL(emcon_overlap(m, 1, x, x, x, i));
   TELL(emcon_constraints(m, 1, x, x, 0, &report));
   TELL(emcon_curvature_times(m, 1, x, 1, x, x));
   TELL(emcon_get_law(0, i, 0, NULL));
   TELL(emcon_get_option(0, i, NULL, 0, NULL));
   TELL(emcon_law_response(1, 0, NULL, NULL, NULL, x, NULL, NULL));
   TELL(emcon_node_gap(NULL, NULL, 0, 0, 0, NULL, NULL, NULL, NULL));
}

/* Nothing in place of arrays: outputs are left out, inputs are missed. */
static void without_arrays(int n_node, int n_constraint)
{
   double one = 1;

   TELL(emcon_get_sizes(m, NULL));
   TELL(emcon_get_time(m, NULL));
   TELL(emcon_get_ledger(m, NULL));
   TELL(emcon_get_verdict(m, NULL, NULL));
   TELL(emcon_get_labels(m, n_node, NULL));
   TELL(emcon_get_state(m, n_node, NULL, NULL));
   TELL(emcon_get_multipliers(m, n_constraint, NULL, NULL));
   TELL(emcon_set_state(m, -1, NULL, NULL, -1, NULL, NULL, NULL));
   TELL(emcon_mass(m, NULL));
   TELL(emcon_guess(m, 0.1, n_node, NULL));
   TELL(emcon_take_snapshot(m, NULL));
   TELL(emcon_restore_snapshot(m, NULL));
   TELL(emcon_evaluate(m, 0.1, n_node, NULL, 0, 0, NULL, NULL));
   TELL(emcon_constraints(m, n_node, NULL, NULL, 0, NULL));
   TELL(emcon_curvature_times(m, 0, &one, n_node, NULL, NULL));
   TELL(emcon_save(m, NULL));
}

/* What was not asked for yet, counts that do not fit, numbers that are none. */
static void with_rubbish(double *x, const emcon_sizes *sizes)
{
   const int n = sizes->n_node, nc = sizes->n_constraint, i[1] = {1};
   const double early = -1;
   emcon_csr matrix;

   TELL(emcon_residual(m, 1, n, x, 0, NULL));
   TELL(emcon_tangent(m, 1, &matrix));
   TELL(emcon_null_space(m, &matrix, NULL, NULL, NULL));
   TELL(emcon_multipliers(m, 0, NULL, nc, x));
   TELL(emcon_curvature_times(m, 0, x, n, x, x));
   TELL(emcon_get_state(m, n - 1, x, NULL));
   TELL(emcon_get_state(m, -1, x, NULL));
   TELL(emcon_get_multipliers(m, nc + 1, x, NULL));
   TELL(emcon_evaluate(m, 0.1, n + 1, x, 0, 0, NULL, NULL));
   TELL(emcon_evaluate(m, 0.1, n, x, 0, nc + 7, x, NULL));
   TELL(emcon_evaluate(m, 0, n, x, 0, 0, NULL, NULL));
   TELL(emcon_evaluate(m, 0.1, n, x, 0, 0, NULL, NULL));
   TELL(emcon_tangent(m, 0, &matrix));
   TELL(emcon_residual(m, 1, 0, NULL, sizes->n_unknown - 1, x));
   TELL(emcon_step(m, NAN, NULL));
   TELL(emcon_step(m, -0.1, NULL));
   TELL(emcon_run(m, NAN, NULL, NULL, NULL));
   TELL(emcon_guess(m, INFINITY, n, x));
   TELL(emcon_next_step(m));
   TELL(emcon_build(m));
   TELL(emcon_set_state(m, n, NULL, NULL, 0, NULL, NULL, &early));
   TELL(emcon_set_load(m, sizes->n_load, 1));
   TELL(emcon_set_load(m, -1, 1));
   TELL(emcon_add_loads(m, EMCON_LOAD_POINT, -1, i, i, x, NULL));
   TELL(emcon_add_loads(m, EMCON_LOAD_POINT, 1, NULL, i, x, NULL));
   TELL(emcon_add_loads(m, 99, 1, i, i, x, NULL));
   TELL(emcon_set_load(m, 0, NAN));
   TELL(emcon_find_load(m, 99, 1, 1, NULL));
   TELL(emcon_set_prescribed(m, 0, 1, 0));
   TELL(emcon_add_prescribed(m, 1, 3, 0));
   TELL(emcon_remove_prescribed(m, 1, 2));
   TELL(emcon_set_threads(m, 0));
   TELL(emcon_save(m, "no/such/folder/file"));
   x[2*n - 1] = NAN;
   TELL(emcon_set_state(m, n, x, NULL, 0, NULL, NULL, NULL));
   TELL(emcon_evaluate(m, 0.1, n, x, 0, 0, NULL, NULL));
   TELL(emcon_constraints(m, n, x, x, 0, NULL));
}

/* A model that was not read, not built, or not loaded. */
static void half_made(const char *deck, char *path)
{
   const char *loose =
      "*NODE\n1, 0., 0.\n2, 1., 0.\n3, 1., 1.\n4, 0., 1.\n*ELEMENT, TYPE=CPE4, ELSET=E\n"
      "1, 1, 2, 3, 4\n*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n*DENSITY\n1.\n"
      "*SOLID SECTION, ELSET=E, MATERIAL=M\n*STEP\n*STATIC\n1., 1.\n*END STEP\n";
   emcon_sizes sizes;

   TELL(emcon_read(NULL, NULL, 0, &m));
   TELL(emcon_get_sizes(m, &sizes));
   TELL(emcon_build(m));
   emcon_close(m);
   TELL(emcon_read_text("*NODE\n1, 0., nowhere", "typed", NULL, 0, &m));
   TELL(emcon_build(m));
   emcon_close(m);
   TELL(emcon_read_text(loose, "loose", NULL, 0, &m));
   TELL(emcon_build(m));
   TELL(emcon_build(m));
   TELL(emcon_step(m, 0.1, NULL));
   emcon_close(m);
   TELL(emcon_read(deck, NULL, 0, &m));
   TELL(emcon_get_sizes(m, &sizes) + 10*(sizes.n_node == 0) + 20*(sizes.n_unknown != 0));
   TELL(emcon_step(m, 0.1, NULL));
   TELL(emcon_mass(m, NULL));
   TELL(emcon_build(m));
   TELL(emcon_step(m, 0.1, NULL));
   emcon_close(m);
   TELL(emcon_load(NULL, &m));
   TELL(emcon_step(m, 0.1, NULL));
   emcon_close(m);
   TELL(emcon_load(deck, &m));
   emcon_close(m);
   TELL(emcon_load(path, &m));
   emcon_close(m);
   m = NULL;
}

/* A file that is made and read gives the same model. */
static int comes_back(char *path)
{
   emcon_model *twin;
   emcon_ledger ledger[2];
   int status;

   if (emcon_save(m, path) != EMCON_OK || emcon_load(path, &twin) != EMCON_OK) return 0;
   status = emcon_step(m, 0.07, NULL) || emcon_step(twin, 0.07, NULL)
      || emcon_get_ledger(m, &ledger[0]) || emcon_get_ledger(twin, &ledger[1]);
   emcon_close(twin);
   return !status && ledger[0].kinetic == ledger[1].kinetic && ledger[0].total == ledger[1].total
      && ledger[0].kinetic > 0;
}

int main(int argc, char **argv)
{
   emcon_sizes sizes;
   char path[1000];
   double *x;

   if (argc < 3) return 2;
   without_model();
   emcon_free_snapshot(NULL);
   emcon_version(NULL, NULL, NULL);
   if (emcon_message(NULL)) return 1;
   snprintf(path, sizeof path, "%s/state.h5", argv[2]);
   half_made(argv[1], path);
   if (emcon_open(argv[1], NULL, 0, &m) != EMCON_OK) return 1;
   if (emcon_get_sizes(m, &sizes) != EMCON_OK) return 1;
   without_arrays(sizes.n_node, sizes.n_constraint);
   x = calloc(2*(size_t)sizes.n_node, sizeof *x);
   with_rubbish(x, &sizes);
   if (!comes_back(path)) return 1;
   free(x);
   emcon_close(m);
   return 0;
}
