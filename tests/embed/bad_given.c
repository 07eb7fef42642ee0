/* What a model cannot be given, and functions that go wrong: each call prints its name, the code
 * and the message.
 *
 * usage: bad_given FILE; a file to try to save to */
#include <emcon.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define TELL(call) tell(#call, call)

enum { N_NODE = 6 };

/* Two nodes of a host, 1 apart, and an element of a law that is given. */
static const char deck[] =
   "*NODE\n1, 0., 0.\n2, 1., 0.\n3, 1., 1.\n4, 0., 1.\n15, 3., 0.\n16, 4., 0.\n"
   "*ELEMENT, TYPE=CPE4, ELSET=E\n1, 1, 2, 3, 4\n*MATERIAL, NAME=SOFT\n*USER MATERIAL\n*DENSITY\n"
   "1.\n*SOLID SECTION, ELSET=E, MATERIAL=SOFT\n*MATERIAL, NAME=STEEL\n*ELASTIC\n1000., 0.3\n"
   "*GIVEN FORCES\n*INITIAL CONDITIONS, TYPE=VELOCITY\n16, 1, 1.\n*STEP, NLGEOM\n*DYNAMIC\n"
   "0.1, 1.\n*END STEP\n";

/* A spring between the host's nodes 4 and 5, along x. */
static const int start[2*N_NODE + 1] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 2, 4, 4};
static const int column[4] = {8, 10, 8, 10};
static const int mass_start[N_NODE + 1] = {0, 0, 0, 0, 0, 1, 2};
static const int mass_column[2] = {4, 5};
static const double masses[2] = {1, 1};

static emcon_model *m;      /* that the messages are of */

/* How a function behaves: what it returns from which call on. */
typedef struct way {
   int status, from, n;
   double factor;           /* of all that it gives */
} way;

static void tell(const char *call, int status)
{
   const char *text = status == EMCON_OK ? "" : emcon_message(m);

   printf("%.*s|%d|%s\n", (int)strcspn(call, "("), call, status, text ? text : "NULL");
}

static int goes_wrong(way *self)
{
   return ++self->n >= self->from ? self->status : 0;
}

static int spring(void *user, int n_node, const double *u0, const double *du, int wants_tangent,
                  double *force, double *magnitude, double *energy, double *tangent)
{
   way *self = (way *)user;
   const double e = (u0[10] - u0[8]) + (du[10] - du[8])/2, e1 = e + (du[10] - du[8])/2;
   const int status = goes_wrong(self);

   (void)magnitude;
   if (n_node != N_NODE) return 99;
   force[10] = self->factor*e;
   force[8] = -force[10];
   *energy = self->factor*e1*e1/2;
   if (wants_tangent) {
      tangent[0] = tangent[3] = self->factor/2;
      tangent[1] = tangent[2] = -self->factor/2;
   }
   return status;
}

/* |z|^2/2 of any number of variables. */
static int square(void *user, int n_point, int n_variable, const double *z, int wants_hessian,
                  double *value, double *gradient, double *hessian)
{
   way *self = (way *)user;
   int i, p;

   for (p = 0; p < n_point; p++) {
      value[p] = 0;
      for (i = 0; i < n_variable; i++) {
         value[p] += self->factor*z[n_variable*p + i]*z[n_variable*p + i]/2;
         gradient[n_variable*p + i] = self->factor*z[n_variable*p + i];
         if (wants_hessian) hessian[n_variable*(n_variable*p + i) + i] = self->factor;
      }
   }
   return goes_wrong(self);
}

static emcon_csr pattern_of(const int *row_start, const int *columns)
{
   emcon_csr matrix = {2*N_NODE, 2*N_NODE, NULL, NULL, NULL};

   matrix.row_start = row_start;
   matrix.column = columns;
   return matrix;
}

static emcon_csr mass_of(const double *value)
{
   emcon_csr matrix = {N_NODE, N_NODE, mass_start, mass_column, NULL};

   matrix.value = value;
   return matrix;
}

/* Wrong arguments. What is right is given last, and twice. */
static void wrong_arguments(way *good, const char *path)
{
   static const double infinite[2] = {1, INFINITY}, negative[2] = {1, -1};
   static const int outside[4] = {8, 12, 8, 10}, backwards[4] = {10, 8, 8, 10};
   static const int twice[2] = {4, 4}, beyond[2] = {4, 6}, host[2] = {4, 5};
   static const int falling[2*N_NODE + 1] = {0, 0, 0, 0, 0, 0, 0, 0, 3, 2, 2, 4, 4};
   emcon_csr pattern = pattern_of(start, column), mass = mass_of(masses), bad;

   TELL(emcon_give_law(m, "SOFT", NULL, NULL));
   TELL(emcon_give_law(m, NULL, square, good));
   TELL(emcon_give_law(m, "HARD", square, good));
   TELL(emcon_give_law(m, "STEEL", square, good));
   TELL(emcon_give_potential(m, "WELL", 2, host, NULL, NULL));
   TELL(emcon_give_potential(m, "WELL", 2, NULL, square, good));
   TELL(emcon_give_potential(m, "WELL", 0, host, square, good));
   TELL(emcon_give_potential(m, "WELL", 2, twice, square, good));
   TELL(emcon_give_potential(m, "WELL", 2, beyond, square, good));
   TELL(emcon_give_force(m, "SPRING", NULL, spring, good));
   TELL(emcon_give_force(m, "SPRING", &pattern, NULL, NULL));
   bad = pattern_of(NULL, column);
   TELL(emcon_give_force(m, "SPRING", &bad, spring, good));
   bad = pattern_of(start, NULL);
   TELL(emcon_give_force(m, "SPRING", &bad, spring, good));
   bad = pattern_of(start, outside);
   TELL(emcon_give_force(m, "SPRING", &bad, spring, good));
   bad = pattern_of(start, backwards);
   TELL(emcon_give_force(m, "SPRING", &bad, spring, good));
   bad = pattern_of(falling, column);
   TELL(emcon_give_force(m, "SPRING", &bad, spring, good));
   TELL(emcon_give_force(m, "SPRING", &mass, spring, good));
   bad.n_row = 0;
   TELL(emcon_give_force(m, "SPRING", &bad, spring, good));
   TELL(emcon_give_mass(m, &pattern));
   bad = mass_of(infinite);
   TELL(emcon_give_mass(m, &bad));
   bad = mass_of(negative);
   TELL(emcon_give_mass(m, &bad));
   TELL(emcon_give_mass(m, NULL));
   TELL(emcon_give_law(m, "soft", square, good));
   TELL(emcon_give_law(m, "SOFT", square, good));
   TELL(emcon_give_force(m, NULL, &pattern, spring, good));
   TELL(emcon_give_mass(m, &mass));
   TELL(emcon_give_mass(m, &mass));
   TELL(emcon_build(m));
   TELL(emcon_give_law(m, "SOFT", square, good));
   TELL(emcon_give_potential(m, "WELL", 2, host, square, good));
   TELL(emcon_give_force(m, NULL, &pattern, spring, good));
   TELL(emcon_give_mass(m, &mass));
   TELL(emcon_step(m, 0.1, NULL));
   TELL(emcon_save(m, path));
   emcon_close(m);
   TELL(emcon_load(path, &m));
   emcon_close(m);
}

/* A model with these functions, built and stepped until something fails. */
static void run(way law, way force, way potential)
{
   static const int host[2] = {4, 5};
   const emcon_csr pattern = pattern_of(start, column), mass = mass_of(masses);
   double before = 0, after = 0;
   int status = emcon_read_text(deck, "bad_given", NULL, 0, &m);

   if (!status) status = emcon_give_law(m, "SOFT", square, &law);
   if (!status) status = emcon_give_force(m, "SPRING", &pattern, spring, &force);
   if (!status) status = emcon_give_potential(m, "WELL", 2, host, square, &potential);
   if (!status) status = emcon_give_mass(m, &mass);
   if (!status) status = emcon_build(m);
   if (status) {
      tell("emcon_build", status);
   } else {
      while (!status && !emcon_is_done(m)) {
         emcon_get_time(m, &before);
         status = emcon_advance(m, NULL);
      }
      tell("emcon_advance", status);
      emcon_get_time(m, &after);
      if (status && after < before) printf("the state is lost\n");
      if (status) {                          /* it goes on where the functions do */
         law.status = force.status = potential.status = 0;
         law.factor = force.factor = potential.factor = 1;
         TELL(emcon_advance(m, NULL));
      }
   }
   emcon_close(m);
}

int main(int argc, char **argv)
{
   const way good = {0, 0, 0, 1}, outside = {1, 0, 0, 1}, failed = {7, 0, 0, 1};
   const way outside_later = {1, 9, 0, 1}, failed_later = {-1, 9, 0, 1}, nan = {0, 0, 0, NAN};
   const emcon_csr mass = mass_of(masses);
   way all = good;

   if (argc < 2) return 2;
   TELL(emcon_read_text(deck, "bad_given", NULL, 0, &m));
   TELL(emcon_build(m));
   emcon_close(m);
   TELL(emcon_read_text(deck, "bad_given", NULL, 0, &m));
   TELL(emcon_give_law(m, "SOFT", square, &all));
   TELL(emcon_build(m));
   emcon_close(m);
   emcon_read_text(deck, "bad_given", NULL, 0, &m);
   TELL(emcon_give_mass(m, &mass));
   TELL(emcon_build(m));
   TELL(emcon_give_mass(m, &mass));
   emcon_close(m);
   emcon_read_text(deck, "bad_given", NULL, 0, &m);
   wrong_arguments(&all, argv[1]);
   run(good, good, good);
   run(outside, good, good);
   run(failed, good, good);
   run(nan, good, good);
   run(good, outside, good);
   run(good, failed, good);
   run(good, nan, good);
   run(good, good, outside);
   run(good, good, failed);
   run(good, good, nan);
   run(outside_later, good, good);
   run(failed_later, good, good);
   run(good, outside_later, good);
   run(good, failed_later, good);
   run(good, good, outside_later);
   run(good, good, failed_later);
   return 0;
}
