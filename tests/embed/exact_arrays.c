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
   double *nodal = numbers(2*sizes.n_node), *unknown = numbers(sizes.n_unknown),
          *lam = numbers(sizes.n_constraint);
   REFUSED(emcon_residual(m, 1, sizes.n_node, nodal, sizes.n_unknown, unknown));
   REFUSED(emcon_tangent(m, 1, &a));
   REFUSED(emcon_null_space(m, &a, &b));
   REFUSED(emcon_multipliers(m, sizes.n_constraint, lam));
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
   double *u1 = numbers(2*n), *nodal = numbers(2*n), *unknown = numbers(sizes.n_unknown),
          *lam = numbers(nc);
   int *active = calloc((size_t)nc + 1, sizeof *active);
   WORKS(emcon_guess(m, 1e-3, n, u1));
   WORKS(emcon_evaluate(m, 1e-3, n, u1, 1, 0, NULL, NULL));
   WORKS(emcon_residual(m, 1, n, nodal, sizes.n_unknown, unknown));
   WORKS(emcon_tangent(m, 1, &a));
   WORKS(emcon_null_space(m, &a, &b));
   WORKS(emcon_multipliers(m, nc, lam));
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

int main(int argc, char **argv)
{
   if (argc < 2) return 2;
   WORKS(emcon_open(argv[1], NULL, 0, &m));
   WORKS(emcon_get_sizes(m, &sizes));
   evaluate();
   int *label = calloc((size_t)sizes.n_node, sizeof *label),
       *unknown = calloc(2*(size_t)sizes.n_node, sizeof *unknown);
   WORKS(emcon_get_labels(m, sizes.n_node, label));
   WORKS(emcon_unknowns(m, sizes.n_node, unknown));
   int n_changed = 0, changed[3];
   for (int d = 0; d < 2*sizes.n_node && n_changed < 3; ++d) {
      if (unknown[d] < 0) continue;
      WORKS(emcon_add_prescribed(m, label[d/2], d%2 + 1, 0));
      changed[n_changed++] = d;
      stale();
      evaluate();
   }
   WORKS(emcon_step(m, 1e-3, NULL));
   evaluate();
   for (int i = 0; i < n_changed; ++i) {
      WORKS(emcon_remove_prescribed(m, label[changed[i]/2], changed[i]%2 + 1));
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
