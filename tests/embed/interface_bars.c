/* A host code in C, and C++, that takes contact from EMCON: two plane trusses collide. Point masses and
 * bars, residual, tangent, elimination and steps are its own; `emcon` marks what contact needs.
 *
 * Bars pull with the mean of their forces at both ends of a step along their direction in its middle, a
 * discrete gradient of their energy. So are the forces of contact: the sum of all energies is constant.
 * Printed are steps, steps in contact, change of the energy, impulse, mean velocity of what has fallen.
 *
 * cc interface_bars.c $(pkg-config --cflags --libs emcon) -lm */
#include <emcon.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { N_LOWER = 10, N_NODE = 16, N_DOF = 2*N_NODE, N_HELD = 10, MAX_BAR = 32, MAX_CONTACT = 8 };
static const double EA = 50, H = 0.01;

/* Positions, displacements, velocities; masses are 1. Nodes of each bar. */
typedef struct host { double x[N_DOF], u[N_DOF], v[N_DOF]; int bar[MAX_BAR][2], n_bar, n_node; } host;

static void add_bar(host *h, int i, int j) { h->bar[h->n_bar][0] = i, h->bar[h->n_bar++][1] = j; }

/* A strip of n square cells with both diagonals, lower row of nodes first. */
static void add_strip(host *h, int n, double x, double y, double vx, double vy)
{
   int first = h->n_node, m = n + 1, dof = 2*first, i;

   for (i = 0; i < 2*m; i++, dof += 2) {
      h->x[dof] = x + i%m, h->x[dof + 1] = y + i/m;
      h->v[dof] = vx, h->v[dof + 1] = vy;
   }
   h->n_node += 2*m;
   for (i = first; i < first + m; i++) {
      add_bar(h, i, i + m);
      if (i == first + n) break;
      add_bar(h, i, i + 1), add_bar(h, i + m, i + m + 1);
      add_bar(h, i, i + m + 1), add_bar(h, i + 1, i + m);
   }
}

/* (l^2 - L^2)/(2 L^2) of a bar at displacements u + s du; its present direction, and L. */
static double strain(const host *h, int k, const double *du, double s, double *direction, double *length)
{
   int i = 2*h->bar[k][0], j = 2*h->bar[k][1], a;
   double square = 0, stretch = 0;

   for (a = 0; a < 2; a++) {
      double side = h->x[j + a] - h->x[i + a], turn = h->u[j + a] - h->u[i + a] + s*(du[j + a] - du[i + a]);
      square += side*side, stretch += (side + 0.5*turn)*turn;
      direction[a] = side + turn;
   }
   *length = sqrt(square);
   return stretch/square;
}

static double energy(const host *h)
{
   double none[N_DOF] = {0}, direction[2], length, sum = 0;
   int k;
   for (k = 0; k < N_DOF; k++) sum += 0.5*h->v[k]*h->v[k];
   for (k = 0; k < h->n_bar; k++) sum += 0.5*EA*pow(strain(h, k, none, 0, direction, &length), 2)*length;
   return sum;
}

/* Residual r and tangent a of a step by du without contact. */
static void respond(const host *h, const double *du, double *r, double (*a)[N_DOF])
{
   int i, k, l, m;

   for (i = 0; i < N_DOF; i++) r[i] += 2/H*(du[i]/H - h->v[i]), a[i][i] += 2/(H*H);
   for (k = 0; k < h->n_bar; k++) {
      double start[2], end[2], length, e0 = strain(h, k, du, 0, start, &length);
      double stress = 0.5*EA*(e0 + strain(h, k, du, 1, end, &length))/length;
      for (l = 0; l < 4; l++) {
         double middle = 0.5*(start[l%2] + end[l%2]), side_l = l < 2 ? -1 : 1;
         int row = 2*h->bar[k][l/2] + l%2;
         r[row] += side_l*stress*middle;
         for (m = 0; m < 4; m++)
            a[row][2*h->bar[k][m/2] + m%2] += side_l*(m < 2 ? -1 : 1)
               *(0.5*EA/pow(length, 3)*middle*end[m%2] + (l%2 == m%2 ? 0.5*stress : 0));
      }
   }
}

/* emcon: add the residual to the last of n columns, and solve; freedoms of the lower row are held. */
static int correct(void *user, int n_dof, const double *du, const emcon_csr *second, int n_unknown, int n, double *b)
{
   double a[N_DOF][N_DOF] = {{0}};
   int i, j, k, last = (n - 1)*n_unknown;

   respond((const host *)user, du, b + last, a);
   for (i = 0; i < n_dof; i++)      /* emcon */
      for (j = second->row_start[i]; j < second->row_start[i + 1]; j++) a[i][second->column[j]] -= second->value[j];
   for (k = N_HELD; k < N_DOF; k++)
      for (i = N_HELD; i < N_DOF; i++) {
         double by = i == k ? 0 : a[i][k]/a[k][k];
         for (j = k; j < N_DOF; j++) a[i][j] -= by*a[k][j];
         for (j = 0; j < n; j++) b[j*N_DOF + i] -= by*b[j*N_DOF + k];
      }
   for (i = 0; i < n*N_DOF; i++) b[i] = i%N_DOF < N_HELD ? 0 : b[i]/a[i%N_DOF][i%N_DOF];
   return 0;
}

static void require(emcon_model *face, int status)                                   /* emcon */
{ if (status != EMCON_OK) fprintf(stderr, "error %d: %s\n", status, emcon_message(face)), exit(status); }

/* emcon: edges of both trusses, with the bodies to their left, and freedoms that are held. */
static emcon_model *make_interface(const host *h, int formulation)
{
   static const int below[] = {9, 8, 8, 7, 7, 6, 6, 5}, above[] = {10, 11, 11, 12};
   int held[N_DOF] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1}, master, slave;
   emcon_model *face;
   int status = emcon_new(N_NODE, 2, h->x, &face);

   require(face, status);
   require(face, emcon_add_surface(face, "lower truss", 4, below, &master));
   require(face, emcon_add_surface(face, "upper truss", 2, above, &slave));
   require(face, emcon_add_pair(face, slave, master, formulation, NULL));
   require(face, emcon_hold(face, N_NODE, held));
   require(face, emcon_build(face));
   return face;
}

int main(int argc, char **argv)
{
   const int formulation = argc > 1 ? atoi(argv[1]) : EMCON_MORTAR, n_step = argc > 2 ? atoi(argv[2]) : 400;
   int active[MAX_CONTACT] = {0}, n_touch = 0, acts, step, i;
   double lam[MAX_CONTACT], du[N_DOF], drift = 0, start, push = 0, after = 0;
   static host h;
   emcon_sizes sizes;
   emcon_model *face;

   add_strip(&h, 4, -2, -1, 0, 0);
   add_strip(&h, 2, -0.875, 0.125, 0.25, -1);
   face = make_interface(&h, formulation);
   require(face, emcon_get_sizes(face, &sizes));
   start = energy(&h);
   for (step = 0; step < n_step; step++) {
      for (i = 0; i < N_DOF; i++) du[i] = H*h.v[i];
      /* emcon */
      require(face, emcon_solve_step(face, N_NODE, h.u, du, NULL, 0, sizes.n_constraint, active, lam, correct, &h));
      for (i = 0; i < N_DOF; i++) h.u[i] += du[i], h.v[i] = 2/H*du[i] - h.v[i];
      drift = fmax(drift, fabs(energy(&h)/start - 1));
      for (i = acts = 0; i < sizes.n_constraint; i++) push += H*lam[i], acts |= active[i];
      n_touch += acts;
   }
   for (i = N_DOF - 11; i < N_DOF; i += 2) after += h.v[i]/6;
   printf("%d %d %.3e %.17g %.17g\n", n_step, n_touch, drift, push, after);
   emcon_close(face);
   return 0;
}
