/* The ring impact, driven from C: the run of the program, increment by increment.
 *
 * usage: impact DECK [NAME=VALUE]...   a run for each of them */
#include <emcon.h>
#include <stdio.h>
#include <stdlib.h>

static int tell(void *user, const emcon_increment *increment, double fraction_done)
{
   int *n = user;

   *n += 1;
   return increment->h > 0 && fraction_done >= 0 ? 0 : 1;
}

static void write_line(void *user, const char *line)
{
   (void)user;
   fprintf(stderr, "%s\n", line);
}

static void require(int status, emcon_model *model)
{
   if (status == EMCON_OK) return;
   fprintf(stderr, "error %d: %s\n", status, emcon_message(model));
   emcon_close(model);
   exit(status);
}

static int impact(const char *deck, const char *parameters)
{
   emcon_model *model;
   emcon_sizes sizes;
   emcon_increment increment;
   emcon_ledger ledger;
   double *u, *v;
   const char *json = NULL;
   int n = 0, status, is_good;

   status = emcon_open(deck, parameters, 0, &model);
   require(status, model);
   require(emcon_get_sizes(model, &sizes), model);
   require(emcon_advance(model, &increment), model);
   require(emcon_run(model, 1e30, tell, write_line, &n), model);
   require(emcon_get_ledger(model, &ledger), model);
   u = malloc(2*sizeof *u*(size_t)sizes.n_node);
   v = malloc(2*sizeof *v*(size_t)sizes.n_node);
   require(emcon_get_state(model, sizes.n_node, u, v), model);
   require(emcon_get_verdict(model, &is_good, &json), model);
   printf("%d %s\n", is_good, json);
   printf("%d %.17g %.17g %.17g %.17g\n", n + 1, ledger.total, ledger.py, u[1], v[1]);
   if (emcon_advance(model, NULL) != EMCON_ERROR_INPUT) return 1;   /* it is at its end */
   if (emcon_get_state(model, sizes.n_node + 1, u, v) != EMCON_ERROR_INPUT) return 1;
   if (!emcon_is_done(model)) return 1;
   free(u);
   free(v);
   emcon_close(model);
   emcon_close(NULL);
   return 0;
}

int main(int argc, char **argv)
{
   int k, status;

   if (argc < 2) return 2;
   status = impact(argv[1], argc > 2 ? argv[2] : NULL);
   for (k = 3; k < argc && status == 0; k++) status = impact(argv[1], argv[k]);
   return status;
}
