/* All calls of a step of contact one by one (an example by one call is interface_bars.c): two plane
 * trusses collide, multipliers are unknowns of the host's elimination, one set of contacts after the other.
 *
 * For each formulation a line is printed, of 400 steps or as many as are asked for: steps, steps in
 * contact, relative change of the energy, smallest gap, largest pressure, mean vertical velocity of
 * the falling truss before and after. */
#include <emcon.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { N_LOWER = 10, N_NODE = 16, N_BAR = 32, N_DOF = 2*N_NODE, MAX_CONTACT = 8,
       N_MAX = N_DOF + MAX_CONTACT };

typedef struct host {
   double x[N_DOF], u[N_DOF], v[N_DOF];   /* positions, displacements, velocities; masses are 1 */
   int is_held[N_DOF];
   int bar[N_BAR][2], n_bar, n_node;
   double stiffness;                      /* EA */
   emcon_model *face;                 /* emcon: from here on */
   int n_contact;
   int active[MAX_CONTACT];
   double lam[MAX_CONTACT];
} host;

/* ---- the host's own code --------------------------------------------------------------------- */

static void add_bar(host *h, int i, int j)
{
   h->bar[h->n_bar][0] = i;
   h->bar[h->n_bar++][1] = j;
}

/* A strip of n square cells with both diagonals, lower row of nodes first. */
static void add_strip(host *h, int n, double x, double y, double vx, double vy)
{
   int first = h->n_node, m = n + 1, i, j;

   for (j = 0; j < 2; j++)
      for (i = 0; i < m; i++) {
         int dof = 2*h->n_node++;

         h->x[dof] = x + i;
         h->x[dof + 1] = y + j;
         h->v[dof] = vx;
         h->v[dof + 1] = vy;
      }
   for (i = first; i < first + m; i++) {
      add_bar(h, i, i + m);
      if (i == first + n) continue;
      add_bar(h, i, i + 1);
      add_bar(h, i + m, i + m + 1);
      add_bar(h, i, i + m + 1);
      add_bar(h, i + 1, i + m);
   }
}

/* (l^2 - L^2)/(2 L^2) of a bar at displacements u + s du; its present direction, and L. */
static double strain(const host *h, int k, const double *du, double s, double *direction,
                     double *length)
{
   int i = 2*h->bar[k][0], j = 2*h->bar[k][1], a;
   double square = 0, stretch = 0;

   for (a = 0; a < 2; a++) {
      double side = h->x[j + a] - h->x[i + a];
      double turn = (h->u[j + a] - h->u[i + a]) + s*(du[j + a] - du[i + a]);

      square += side*side;
      stretch += (side + 0.5*turn)*turn;
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
   for (k = 0; k < h->n_bar; k++) {
      double e = strain(h, k, none, 0, direction, &length);

      sum += 0.5*h->stiffness*length*e*e;
   }
   return sum;
}

/* Residual r, tangent a of a step of size dt by du without contact, sizes of what r consists of. */
static void respond(const host *h, double dt, const double *du, double *r, double (*a)[N_MAX],
                    double *magnitude)
{
   int k, l, m;

   memset(a, 0, sizeof(double[N_MAX][N_MAX]));
   for (k = 0; k < N_DOF; k++) {
      r[k] = 2/dt*(du[k]/dt - h->v[k]);
      magnitude[k] = 2/dt*(fabs(du[k]/dt) + fabs(h->v[k]));
      a[k][k] = 2/(dt*dt);
   }
   for (k = 0; k < h->n_bar; k++) {
      int i = 2*h->bar[k][0], j = 2*h->bar[k][1];
      double start[2], end[2], middle[2], length;
      double e0 = strain(h, k, du, 0, start, &length), e1 = strain(h, k, du, 1, end, &length);
      double stress = 0.5*h->stiffness*(e0 + e1)/length;

      for (l = 0; l < 2; l++) {
         middle[l] = 0.5*(start[l] + end[l]);
         r[j + l] += stress*middle[l];
         r[i + l] -= stress*middle[l];
         magnitude[i + l] += fabs(stress*middle[l]);
         magnitude[j + l] += fabs(stress*middle[l]);
      }
      for (l = 0; l < 2; l++)
         for (m = 0; m < 2; m++) {
            double t = 0.5*h->stiffness/(length*length*length)*middle[l]*end[m];

            if (l == m) t += 0.5*stress;
            a[i + l][i + m] += t;
            a[j + l][j + m] += t;
            a[i + l][j + m] -= t;
            a[j + l][i + m] -= t;
         }
   }
}

/* Gaussian elimination with row pivots; b becomes the solution. */
static void solve(int n, double (*a)[N_MAX], double *b)
{
   int i, j, k;

   for (k = 0; k < n; k++) {
      int best = k;
      double t;

      for (i = k + 1; i < n; i++)
         if (fabs(a[i][k]) > fabs(a[best][k])) best = i;
      for (j = 0; j < n; j++) t = a[k][j], a[k][j] = a[best][j], a[best][j] = t;
      t = b[k], b[k] = b[best], b[best] = t;
      for (i = k + 1; i < n; i++) {
         double f = a[i][k]/a[k][k];

         for (j = k; j < n; j++) a[i][j] -= f*a[k][j];
         b[i] -= f*b[k];
      }
   }
   for (k = n - 1; k >= 0; k--) {
      for (j = k + 1; j < n; j++) b[k] -= a[k][j]*b[j];
      b[k] /= a[k][k];
   }
}

/* ---- emcon: contact -------------------------------------------------------------------------- */

static void require(host *h, int status)
{
   if (status == EMCON_OK) return;
   fprintf(stderr, "error %d: %s\n", status, emcon_message(h->face));
   emcon_close(h->face);
   exit(status);
}

/* The upper row of the lower truss from right to left, and the lower row of the upper truss from
 * left to right: bodies are to the left of their edges. */
static void make_interface(host *h, int formulation)
{
   static const int lower[] = {9, 8, 8, 7, 7, 6, 6, 5}, upper[] = {10, 11, 11, 12};
   emcon_sizes sizes;
   int master, slave;

   require(h, emcon_new(h->n_node, 2, h->x, &h->face));
   require(h, emcon_add_surface(h->face, "lower truss", 4, lower, &master));
   require(h, emcon_add_surface(h->face, "upper truss", 2, upper, &slave));
   require(h, emcon_add_pair(h->face, slave, master, formulation, NULL));
   require(h, emcon_hold(h->face, h->n_node, h->is_held));
   require(h, emcon_build(h->face));
   require(h, emcon_get_sizes(h->face, &sizes));
   h->n_contact = sizes.n_contact;
   if (h->n_contact > MAX_CONTACT) exit(1);
}

/* Newton's method for the n selected contacts, with their multipliers as unknowns:
 *
 *    [ tangent - curvature   -g^T ] [ d du  ]     [ residual - g^T lam ]
 *    [ c                      0   ] [ d lam ] = - [ defect             ] */
static void newton(host *h, double dt, int n, double *du, double *magnitude)
{
   static double a[N_MAX][N_MAX];
   double b[N_MAX], r[N_DOF], size = 0, step = HUGE_VAL, last;
   emcon_constraint_report contact;
   const emcon_csr *g = &contact.discrete_gradient, *c = &contact.end_gradient;
   emcon_csr curvature;
   int iteration, i, j, k;

   for (i = 0; i < N_DOF; i++) size = fmax(size, fabs(h->x[i]));
   for (k = 0; k < n; k++) h->lam[k] = 0;
   for (iteration = 0; iteration < 25; iteration++) {
      respond(h, dt, du, r, a, magnitude);
      require(h, emcon_evaluate_contact(h->face, N_NODE, h->u, du, &contact));
      require(h, emcon_curvature(h->face, n, h->lam, &curvature));
      for (i = 0; i < N_DOF; i++) {
         b[i] = -r[i];
         for (j = curvature.row_start[i]; j < curvature.row_start[i + 1]; j++)
            a[i][curvature.column[j]] -= curvature.value[j];
      }
      for (k = 0; k < n; k++) {
         b[N_DOF + k] = -contact.defect[k];
         for (j = g->row_start[k]; j < g->row_start[k + 1]; j++) {
            a[g->column[j]][N_DOF + k] = -g->value[j];
            a[N_DOF + k][c->column[j]] = c->value[j];
            b[g->column[j]] += g->value[j]*h->lam[k];
         }
      }
      for (i = 0; i < N_DOF; i++) {
         if (!h->is_held[i]) continue;
         for (j = 0; j < N_DOF + n; j++) a[i][j] = a[j][i] = 0;
         a[i][i] = 1;
         b[i] = 0;
      }
      solve(N_DOF + n, a, b);
      last = step;
      step = 0;
      for (i = 0; i < N_DOF; i++) {
         du[i] += b[i];
         step = fmax(step, fabs(b[i]));
      }
      for (k = 0; k < n; k++) h->lam[k] += b[N_DOF + k];
      /* Down to where round-off keeps the steps from getting smaller. */
      if (step == 0 || (step <= 1e-12*size && step >= last)) return;
   }
   fprintf(stderr, "no convergence: %g\n", step);
   exit(1);
}

/* One step of size dt: sets of contacts, until one stands. */
static void advance(host *h, double dt, double *gap, double *pressure)
{
   double du[N_DOF], magnitude[N_DOF], area[MAX_CONTACT];
   emcon_gap state[MAX_CONTACT];
   int i, k, n, is_done = 0, outcome = EMCON_STEP_DONE;

   for (i = 0; i < N_DOF; i++) du[i] = h->is_held[i] ? 0 : dt*h->v[i];
   require(h, emcon_begin_contact(h->face, N_NODE, h->u, du, h->n_contact, h->active,
                                  h->active));
   while (!is_done) {
      require(h, emcon_select(h->face, N_NODE, h->u, du, h->n_contact, h->active, &n));
      newton(h, dt, n, du, magnitude);
      require(h, emcon_update_active(h->face, N_NODE, h->u, du, n, h->lam, magnitude,
                                     h->n_contact, h->active, &is_done, &outcome));
   }
   if (outcome != EMCON_STEP_DONE) {
      fprintf(stderr, "the step failed, %d\n", outcome);
      exit(1);
   }
   require(h, emcon_get_gaps(h->face, N_NODE, h->u, du, h->n_contact, state));
   for (i = 0; i < N_DOF; i++) {
      h->u[i] += du[i];
      h->v[i] = 2*du[i]/dt - h->v[i];
   }
   require(h, emcon_get_areas(h->face, N_NODE, h->u, h->n_contact, area, NULL));
   for (i = k = 0; i < h->n_contact; i++) {
      if (state[i].is_near) *gap = fmin(*gap, state[i].gap1);
      if (h->active[i]) *pressure = fmax(*pressure, h->lam[k++]/area[i]);
   }
}

int main(int argc, char **argv)
{
   const int n_step = argc > 1 ? atoi(argv[1]) : 400;
   int formulation, step, i;

   for (formulation = EMCON_NODE_TO_SEGMENT; formulation <= EMCON_MORTAR; formulation++) {
      host h;
      double start, drift = 0, gap = HUGE_VAL, pressure = 0, before, after = 0;
      int n_touch = 0;

      memset(&h, 0, sizeof h);
      h.stiffness = 50;
      add_strip(&h, 4, -2, -1, 0, 0);
      add_strip(&h, 2, -0.875, 0.125, 0.25, -1);
      for (i = 0; i < N_LOWER; i++) h.is_held[i] = 1;   /* x and y of 5 nodes */
      make_interface(&h, formulation);
      start = energy(&h);
      before = h.v[N_DOF - 1];
      for (step = 0; step < n_step; step++) {
         int touches = 0;

         advance(&h, 0.01, &gap, &pressure);
         drift = fmax(drift, fabs(energy(&h) - start)/start);
         for (i = 0; i < h.n_contact; i++) touches |= h.active[i];
         n_touch += touches;
      }
      for (i = 2*N_LOWER + 1; i < N_DOF; i += 2) after += h.v[i]/(N_NODE - N_LOWER);
      printf("%d %d %.3e %.3e %.3e %.17g %.17g\n", n_step, n_touch, drift, gap, pressure, before,
             after);
      emcon_close(h.face);
   }
   return 0;
}
