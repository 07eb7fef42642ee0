/* Steps of a size of one's own, in C: halved where they are too long, with conditions that change,
 * and checked by the matrices of the model. Gravity is doubled at half time.
 *
 * usage: query DECK [NAME=VALUE] */
#include <emcon.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void require(int status, emcon_model *model)
{
   if (status == EMCON_OK) return;
   fprintf(stderr, "error %d: %s\n", status, emcon_message(model));
   emcon_close(model);
   exit(status);
}

static void *room(size_t n, size_t size)
{
   void *made = calloc(n > 0 ? n : 1, size);

   if (!made) exit(EMCON_ERROR_INTERNAL);
   return made;
}

/* Kinetic energy by the mass matrix, v . M v / 2 over both directions. */
static double kinetic_energy(emcon_model *model, const double *v)
{
   emcon_csr mass;
   double sum = 0;
   int i, k;

   require(emcon_mass(model, &mass), model);
   for (i = 0; i < mass.n_row; i++)
      for (k = mass.row_start[i]; k < mass.row_start[i + 1]; k++) {
         const int j = mass.column[k];
         sum += mass.value[k]*(v[2*i]*v[2*j] + v[2*i + 1]*v[2*j + 1])/2;
      }
   return sum;
}

/* One step in which no node moves by more than `most`, halved until that holds: a criterion of the
 * program, of which the library knows nothing. Returns the size that was left. */
static double careful_step(emcon_model *model, double h, double most, const emcon_sizes *sizes)
{
   emcon_snapshot *before;
   double *u0 = room(2*(size_t)sizes->n_node, sizeof *u0);
   double *u1 = room(2*(size_t)sizes->n_node, sizeof *u1);
   double motion;
   int i, status;

   require(emcon_get_state(model, sizes->n_node, u0, NULL), model);
   require(emcon_take_snapshot(model, &before), model);
   for (;; h /= 2) {
      status = emcon_step(model, h, NULL);
      motion = 0;
      if (status != EMCON_ERROR_ANALYSIS) {
         require(status, model);
         require(emcon_get_state(model, sizes->n_node, u1, NULL), model);
         for (i = 0; i < 2*sizes->n_node; i++) motion = fmax(motion, fabs(u1[i] - u0[i]));
         if (motion <= most) break;
      } else if (h < 1e-6) {
         require(status, model);
      }
      require(emcon_restore_snapshot(model, before), model);
   }
   emcon_free_snapshot(before);
   free(u0);
   free(u1);
   return h;
}

/* Largest entry of rows times a matrix; all that went into it by magnitude goes into `terms`. */
static double largest_product(const emcon_csr *rows, int i, const emcon_csr *to, double *terms)
{
   double *sum = room((size_t)to->n_column, sizeof *sum), largest = 0;
   int j, k;

   for (k = rows->row_start[i]; k < rows->row_start[i + 1]; k++)
      for (j = to->row_start[rows->column[k]]; j < to->row_start[rows->column[k] + 1]; j++) {
         sum[to->column[j]] += rows->value[k]*to->value[j];
         *terms = fmax(*terms, fabs(rows->value[k]*to->value[j]));
      }
   for (j = 0; j < to->n_column; j++) largest = fmax(largest, fabs(sum[j]));
   free(sum);
   return largest;
}

/* For the contacts that act in a step of the size h, with discrete gradients G and gradients at the
 * end C: largest entries of P^T G^T and of C DF. The deck has persistent contact: gaps are kept. */
static void check_null_space(emcon_model *model, double h, const emcon_sizes *sizes)
{
   double *u0 = room(2*(size_t)sizes->n_node, sizeof *u0);
   double *u1 = room(2*(size_t)sizes->n_node, sizeof *u1);
   int *acts = room((size_t)sizes->n_constraint, sizeof *acts);
   emcon_constraint_report report;
   emcon_csr p, df;
   double of_p = 0, of_df = 0, terms = 0;
   int i, n_active = 0;

   require(emcon_get_state(model, sizes->n_node, u0, NULL), model);
   require(emcon_get_multipliers(model, sizes->n_constraint, NULL, acts), model);
   require(emcon_guess(model, h, sizes->n_node, u1), model);
   require(emcon_evaluate(model, h, sizes->n_node, u1, 0, sizes->n_constraint, NULL, acts), model);
   require(emcon_null_space(model, &p, &df, NULL, NULL), model);
   require(emcon_constraints(model, sizes->n_node, u0, u1, 1, &report), model);
   for (i = 0; i < report.n; i++) {
      if (!acts[report.id[i]]) continue;
      n_active++;
      of_p = fmax(of_p, largest_product(&report.discrete_gradient, i, &p, &terms));
      of_df = fmax(of_df, largest_product(&report.end_gradient, i, &df, &terms));
   }
   printf("null space: %d %d %d %.17g %.17g %.17g\n", n_active, sizes->n_unknown, p.n_column, of_p,
          of_df, terms);
   free(u0);
   free(u1);
   free(acts);
}

/* Give gravity on all elements another value. */
static void set_gravity(emcon_model *model, double value, const emcon_sizes *sizes)
{
   int load;

   for (load = 0; load < sizes->n_load; load++) require(emcon_set_load(model, load, value), model);
}

int main(int argc, char **argv)
{
   emcon_model *model;
   emcon_sizes sizes;
   emcon_ledger ledger;
   double *v, time = 0, h;
   const double step = 0.05, end = 1.0;
   int n = 0;

   if (argc < 2) return EMCON_ERROR_INPUT;
   require(emcon_open(argv[1], argc > 2 ? argv[2] : NULL, 0, &model), model);
   require(emcon_get_sizes(model, &sizes), model);
   v = room(2*(size_t)sizes.n_node, sizeof *v);
   while (time < end) {
      if (n++ == 10) set_gravity(model, 20, &sizes);
      h = careful_step(model, step, 0.3, &sizes);
      require(emcon_get_time(model, &time), model);
      require(emcon_get_ledger(model, &ledger), model);
      require(emcon_get_state(model, sizes.n_node, NULL, v), model);
      printf("step: %.17g %.17g %.17g %.17g %.17g %.17g\n", h, time, ledger.py, ledger.total,
             ledger.kinetic, kinetic_energy(model, v));
   }
   check_null_space(model, step, &sizes);
   free(v);
   emcon_close(model);
   return 0;
}
