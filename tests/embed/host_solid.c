/* A code with a solid of its own, in C: triangles that the library does not know stand on a bed of
 * springs, and a block of the library's elements, of a law that is given too, falls on them. The
 * host gives mass, forces and tangent; the library does contact, Newton's method and the step.
 *
 * usage: host_solid FORMULATION [H] */
#include <emcon.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
   NX = 6, NY = 2,                        /* squares of the host's solid, of two triangles each */
   MX = 5, MY = 2,                        /* elements of the block */
   N_HOST = (NX + 1)*(NY + 1), N_NODE = N_HOST + (MX + 1)*(MY + 1), N_TRIANGLE = 2*NX*NY,
   N_NEAR = 9                             /* nodes that share a triangle with one, and itself */
};

static const double modulus = 200, shear = 100, density = 1, bed = 50, cubic = 1e4;

/* The solid: the nodes of the deck up to N_HOST, triangles, and sparse matrices over all nodes. */
typedef struct host {
   double x[N_NODE][2];
   int triangle[N_TRIANGLE][3];
   int start[N_NODE + 1], column[N_HOST*N_NEAR];
   int start2[2*N_NODE + 1], column2[4*N_HOST*N_NEAR];
   double mass[N_HOST*N_NEAR];
} host;

/* ---- mesh and matrices ----------------------------------------------------------------------- */

/* Nodes of a grid of n x m squares, row by row upwards; the last one has the number *k - 1. */
static void place(double (*x)[2], int *k, int n, int m, double x0, double y0, double width,
                  double height)
{
   int i, j;

   for (j = 0; j <= m; j++) {
      for (i = 0; i <= n; i++, ++*k) {
         x[*k][0] = x0 + width*i/n;
         x[*k][1] = y0 + height*j/m;
      }
   }
}

static void make_mesh(host *self)
{
   int i, j, k = 0;

   place(self->x, &k, NX, NY, 0, 0, 3, 1);
   place(self->x, &k, MX, MY, 0.7, 1.05, 1.5, 0.6);
   for (j = 0; j < NY; j++) {
      for (i = 0; i < NX; i++) {
         const int a = j*(NX + 1) + i, b = a + NX + 1;
         int *one = self->triangle[2*(j*NX + i)], *other = self->triangle[2*(j*NX + i) + 1];

         one[0] = a; one[1] = a + 1; one[2] = b + 1;
         other[0] = a; other[1] = b + 1; other[2] = b;
      }
   }
}

/* Gradients of the shape functions; the area. */
static double shape(const host *self, const int *node, double gradient[3][2])
{
   const double (*x)[2] = (const double (*)[2])self->x;
   double twice = 0;
   int a;

   for (a = 0; a < 3; a++) {
      const double *p = x[node[(a + 1)%3]], *q = x[node[(a + 2)%3]];

      gradient[a][0] = p[1] - q[1];
      gradient[a][1] = q[0] - p[0];
      twice += x[node[a]][0]*gradient[a][0];
   }
   for (a = 0; a < 3; a++) {
      gradient[a][0] /= twice;
      gradient[a][1] /= twice;
   }
   return twice/2;
}

/* The place of the entry (a, b) in the matrix of nodes. */
static int slot(const host *self, int a, int b)
{
   int k = self->start[a];

   while (self->column[k] != b) k++;
   return k;
}

/* The place of the entry (2a + i, 2b + j) in the matrix of freedoms. */
static int slot2(const host *self, int a, int i, int b, int j)
{
   return self->start2[2*a + i] + 2*(slot(self, a, b) - self->start[a]) + j;
}

/* The patterns: nodes that share a triangle; and the consistent mass. */
static void make_matrices(host *self)
{
   static char meets[N_NODE][N_NODE];
   double gradient[3][2];
   int a, b, i, t, n = 0, n2 = 0;

   for (t = 0; t < N_TRIANGLE; t++) {
      for (a = 0; a < 9; a++) meets[self->triangle[t][a/3]][self->triangle[t][a%3]] = 1;
   }
   for (a = 0; a < N_NODE; a++) {
      self->start[a] = n;
      for (b = 0; b < N_NODE; b++) {
         if (meets[a][b]) self->column[n++] = b;
      }
      for (i = 0; i < 2; i++) {
         self->start2[2*a + i] = n2;
         for (b = self->start[a]; b < n; b++) {
            self->column2[n2++] = 2*self->column[b];
            self->column2[n2++] = 2*self->column[b] + 1;
         }
      }
   }
   self->start[N_NODE] = n;
   self->start2[2*N_NODE] = n2;
   for (t = 0; t < N_TRIANGLE; t++) {
      const int *node = self->triangle[t];
      const double part = density*shape(self, node, gradient)/12;

      for (a = 0; a < 3; a++) {
         for (b = 0; b < 3; b++) self->mass[slot(self, node[a], node[b])] += a == b ? 2*part : part;
      }
   }
}

/* ---- what the library calls ------------------------------------------------------------------ */

/* Displacement gradient, plus one: F; and the strains E11, E22, 2 E12, in which rigid motion does
 * not cancel. */
static void strain_of(const int *node, double gradient[3][2], const double *u, double f[2][2],
                      double e[3])
{
   double g[2][2] = {{0, 0}, {0, 0}};
   int a, i, j;

   for (i = 0; i < 2; i++) {
      for (j = 0; j < 2; j++) {
         for (a = 1; a < 3; a++) g[i][j] += (u[2*node[a] + i] - u[2*node[0] + i])*gradient[a][j];
         f[i][j] = g[i][j] + (i == j);
      }
   }
   e[0] = g[0][0] + (g[0][0]*g[0][0] + g[1][0]*g[1][0])/2;
   e[1] = g[1][1] + (g[0][1]*g[0][1] + g[1][1]*g[1][1])/2;
   e[2] = g[0][1] + g[1][0] + g[0][0]*g[0][1] + g[1][0]*g[1][1];
}

/* Derivatives of the strains by the displacement of a node with this shape gradient. */
static void strain_rows(double f[2][2], const double *gradient, double b[3][2])
{
   int i;

   for (i = 0; i < 2; i++) {
      b[0][i] = f[i][0]*gradient[0];
      b[1][i] = f[i][1]*gradient[1];
      b[2][i] = f[i][0]*gradient[1] + f[i][1]*gradient[0];
   }
}

/* St. Venant and Kirchhoff's law. */
static void stress_of(const double e[3], double s[3])
{
   s[0] = modulus*(e[0] + e[1]) + 2*shear*e[0];
   s[1] = modulus*(e[0] + e[1]) + 2*shear*e[1];
   s[2] = shear*e[2];
}

/* Add the derivative of the forces of node a by the displacement of node b at the end. */
static void add_tangent(const host *self, const int *node, int a, int b, double area,
                        double gradient[3][2], double middle[2][2], double f1[2][2],
                        const double s[3], double *tangent)
{
   const double *p = gradient[a], *q = gradient[b];
   const double initial = p[0]*s[0]*q[0] + p[1]*s[1]*q[1] + s[2]*(p[0]*q[1] + p[1]*q[0]);
   double of_a[3][2], of_b[3][2], change[3], of_stress[3];
   int i, j, k;

   strain_rows(middle, p, of_a);
   strain_rows(f1, q, of_b);
   for (j = 0; j < 2; j++) {
      for (k = 0; k < 3; k++) change[k] = of_b[k][j];
      stress_of(change, of_stress);
      for (i = 0; i < 2; i++) {
         double sum = i == j ? initial : 0;

         for (k = 0; k < 3; k++) sum += of_a[k][i]*of_stress[k];
         tangent[slot2(self, node[a], i, node[b], j)] += area*sum/2;
      }
   }
}

/* The stress of the mean of the strains, on the displacements in the middle: forces . du is the
 * change of the energy exactly, as the energy is quadratic in the strains and those in u. */
static int solid(void *user, int n_node, const double *u0, const double *du, int wants_tangent,
                 double *force, double *magnitude, double *energy, double *tangent)
{
   const host *self = (const host *)user;
   double u1[2*N_NODE], gradient[3][2], f0[2][2], f1[2][2], middle[2][2];
   double e0[3], e1[3], e[3], s[3], s1[3], b[3][2];
   int a, i, k, t;

   if (n_node != N_NODE) return 2;
   for (i = 0; i < 2*N_NODE; i++) u1[i] = u0[i] + du[i];
   *energy = 0;
   for (t = 0; t < N_TRIANGLE; t++) {
      const int *node = self->triangle[t];
      const double area = shape(self, node, gradient);

      strain_of(node, gradient, u0, f0, e0);
      strain_of(node, gradient, u1, f1, e1);
      if (f1[0][0]*f1[1][1] - f1[0][1]*f1[1][0] <= 0) return 1;
      for (k = 0; k < 3; k++) e[k] = (e0[k] + e1[k])/2;
      for (k = 0; k < 4; k++) middle[k/2][k%2] = (f0[k/2][k%2] + f1[k/2][k%2])/2;
      stress_of(e, s);
      stress_of(e1, s1);
      for (k = 0; k < 3; k++) *energy += area*s1[k]*e1[k]/2;
      for (a = 0; a < 3; a++) {
         strain_rows(middle, gradient[a], b);
         for (i = 0; i < 2; i++) {
            for (k = 0; k < 3; k++) {
               force[2*node[a] + i] += area*b[k][i]*s[k];
               magnitude[2*node[a] + i] += fabs(area*b[k][i]*s[k]);
            }
         }
         for (k = 0; wants_tangent && k < 3; k++)
            add_tangent(self, node, a, k, area, gradient, middle, f1, s, tangent);
      }
   }
   return 0;
}

/* A bed of springs: bed y^2/2 at each point. */
static int springs(void *user, int n_point, int n_variable, const double *z, int wants_hessian,
                   double *value, double *gradient, double *hessian)
{
   int p;

   (void)user;
   if (n_variable != 2) return 2;
   for (p = 0; p < n_point; p++) {
      const double y = z[2*p + 1];

      value[p] = bed*y*y/2;
      gradient[2*p] = 0;
      gradient[2*p + 1] = bed*y;
      if (wants_hessian) {
         hessian[4*p] = hessian[4*p + 1] = hessian[4*p + 2] = 0;
         hessian[4*p + 3] = bed;
      }
   }
   return 0;
}

/* A law that gets stiffer: lambda tr^2/2 + mu q + c q^2/2, of q = |E|^2. */
static int foam(void *user, int n_point, int n_variable, const double *z, int wants_hessian,
                double *value, double *gradient, double *hessian)
{
   int i, j, p;

   (void)user;
   if (n_variable != 3) return 2;
   for (p = 0; p < n_point; p++) {
      const double *e = z + 3*p, trace = e[0] + e[1];
      const double q = e[0]*e[0] + e[1]*e[1] + e[2]*e[2]/2, slope = shear + cubic*q;
      const double of_q[3] = {2*e[0], 2*e[1], e[2]};

      if ((1 + 2*e[0])*(1 + 2*e[1]) - e[2]*e[2] <= 0) return 1;
      value[p] = modulus*trace*trace/2 + shear*q + cubic*q*q/2;
      for (i = 0; i < 3; i++) {
         gradient[3*p + i] = (i < 2 ? modulus*trace : 0) + slope*of_q[i];
         for (j = 0; wants_hessian && j < 3; j++)
            hessian[9*p + 3*i + j] = (i < 2 && j < 2 ? modulus : 0) + cubic*of_q[i]*of_q[j]
                                     + (i == j ? slope*(i < 2 ? 2 : 1) : 0);
      }
   }
   return 0;
}

/* ---- the deck, and the run ------------------------------------------------------------------- */

/* Nodes, the block, surfaces and the step. Labels count from 1. */
static void write_deck(const host *self, const char *formulation, double h, char *text)
{
   char *at = text + sprintf(text, "*NODE\n");
   int i, j;

   for (i = 0; i < N_NODE; i++)
      at += sprintf(at, "%d, %.17g, %.17g\n", i + 1, self->x[i][0], self->x[i][1]);
   at += sprintf(at, "*ELEMENT, TYPE=CPE4, ELSET=BLOCK\n");
   for (j = 0; j < MY; j++) {
      for (i = 0; i < MX; i++) {
         const int a = N_HOST + j*(MX + 1) + i + 1, b = a + MX + 1;

         at += sprintf(at, "%d, %d, %d, %d, %d\n", j*MX + i + 1, a, a + 1, b + 1, b);
      }
   }
   at += sprintf(at, "*ELSET, ELSET=LOWEST, GENERATE\n1, %d\n*NSET, NSET=FALLING, GENERATE\n"
                 "%d, %d\n*GIVEN FORCES\n", MX, N_HOST + 1, N_NODE);
   at += sprintf(at, "*MATERIAL, NAME=FOAM\n*USER MATERIAL\n*DENSITY\n%g\n*SOLID SECTION, "
                 "ELSET=BLOCK, MATERIAL=FOAM\n*SURFACE, NAME=BLOCK\nLOWEST, S1\n", density);
   at += sprintf(at, "*SURFACE, NAME=SOLID, TYPE=EDGE\n");
   for (i = N_HOST; i > N_HOST - NX; i--) at += sprintf(at, "%d, %d\n", i, i - 1);
   at += sprintf(at, "*SURFACE INTERACTION, NAME=HARD\n*CONTACT PAIR, INTERACTION=HARD, TYPE=%s\n"
                 "BLOCK, SOLID\n*INITIAL CONDITIONS, TYPE=VELOCITY\nFALLING, 1, 0.3\n"
                 "FALLING, 2, -1.\n", formulation);
   sprintf(at, "*STEP, NLGEOM\n*DYNAMIC\n%.17g, 0.5\n*END STEP\n", h);
}

static void require(int status, emcon_model *model)
{
   if (status == EMCON_OK) return;
   printf("error %d: %s\n", status, emcon_message(model));
   emcon_close(model);
   exit(status);
}

/* All that the model is given, before it is built. */
static void give(emcon_model *model, host *self)
{
   const emcon_csr mass = {N_NODE, N_NODE, self->start, self->column, self->mass};
   const emcon_csr pattern = {2*N_NODE, 2*N_NODE, self->start2, self->column2, NULL};
   int foot[NX + 1], i;

   for (i = 0; i <= NX; i++) foot[i] = i;
   require(emcon_give_mass(model, &mass), model);
   require(emcon_give_force(model, "triangles", &pattern, solid, self), model);
   require(emcon_give_potential(model, "bed", NX + 1, foot, springs, NULL), model);
   require(emcon_give_law(model, "FOAM", foam, NULL), model);
}

int main(int argc, char **argv)
{
   static host self;
   static char deck[100*N_NODE + 2000];
   emcon_model *model;
   emcon_increment increment;
   emcon_ledger ledger;
   int status;

   if (argc < 2) return 2;
   make_mesh(&self);
   make_matrices(&self);
   write_deck(&self, argv[1], argc > 2 ? atof(argv[2]) : 0.01, deck);
   status = emcon_read_text(deck, "host_solid", NULL, 0, &model);
   require(status, model);
   give(model, &self);
   require(emcon_build(model), model);
   memset(&increment, 0, sizeof increment);
   for (;;) {
      require(emcon_get_ledger(model, &ledger), model);
      printf("%.17g %.17g %.17g %.17g %.17g %.17g %.17g %d\n", increment.time, ledger.total,
             ledger.kinetic, ledger.strain, ledger.potential, ledger.px, ledger.py,
             increment.n_active);
      if (emcon_is_done(model)) break;
      require(emcon_advance(model, &increment), model);
   }
   emcon_close(model);
   return 0;
}
