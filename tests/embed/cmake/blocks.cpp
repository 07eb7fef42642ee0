// An elastic block lands askew on a plate and rubs over it, in space: a small finite element code in
// plain C++ that takes contact with friction from EMCON. Linear hexahedra, consistent mass, steps that
// keep the energy, a dense solver. Unknowns w are those of the block; the map u = A w tells EMCON so.
//
//    blocks nodes|mortar FRICTION N_STEP
//
// Prints what came of it, then the displacements of the block.
#include <emcon.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

using Vector = std::vector<double>;
const int N = 3, N_NODE = (N + 1)*(N + 1)*2, N_DOF = 3*N_NODE, N_PLATE = 4, N_ALL = 3*(N_PLATE + N_NODE);
const double LAME[2] = {60, 40}, H = 0.02, SIZE = 1.0/N, HIGH = 0.4;

struct Matrix : Vector {
   int n, m;
   Matrix(int rows, int columns) : Vector(static_cast<std::size_t>(rows)*columns), n(rows), m(columns) {}
   double &operator()(int i, int j) { return (*this)[static_cast<std::size_t>(i)*m + j]; }
};

int node(int i, int j, int k) { return (i*(N + 1) + j)*2 + k; }

// Stiffness and mass of the block, N x N cells of one layer.
void assemble(Matrix &stiffness, Matrix &mass)
{
   for (int cell = 0; cell < N*N; ++cell)
      for (int point = 0; point < 8; ++point) {
         int dof[8];
         double shape[8], slope[8][3];
         const double size[3] = {SIZE, SIZE, HIGH}, volume = SIZE*SIZE*HIGH/8;
         for (int a = 0; a < 8; ++a) {
            const int at[3] = {a & 1, a >> 1 & 1, a >> 2};
            double part[3];
            for (int d = 0; d < 3; ++d) {
               const double xi = 0.5 + ((point >> d & 1) ? 0.5 : -0.5)/std::sqrt(3.0);
               part[d] = at[d] ? xi : 1 - xi;
            }
            dof[a] = 3*node(cell/N + at[0], cell%N + at[1], at[2]);
            shape[a] = part[0]*part[1]*part[2];
            for (int d = 0; d < 3; ++d) slope[a][d] = (2*at[d] - 1)*part[(d + 1)%3]*part[(d + 2)%3]/size[d];
         }
         for (int a = 0; a < 8; ++a)
            for (int b = 0; b < 8; ++b)
               for (int i = 0; i < 3; ++i) {
                  mass(dof[a] + i, dof[b] + i) += volume*shape[a]*shape[b];
                  for (int j = 0; j < 3; ++j) {
                     stiffness(dof[a] + i, dof[b] + j) +=
                        volume*(LAME[0]*slope[a][i]*slope[b][j] + LAME[1]*slope[a][j]*slope[b][i]);
                     stiffness(dof[a] + i, dof[b] + i) += volume*LAME[1]*slope[a][j]*slope[b][j];
                  }
               }
      }
}

// The columns of b become those of a^-1 b: elimination with pivots.
void solve(Matrix a, Matrix &b)
{
   for (int k = 0; k < a.n; ++k) {
      int pivot = k;
      for (int i = k; i < a.n; ++i)
         if (std::fabs(a(i, k)) > std::fabs(a(pivot, k))) pivot = i;
      for (int j = 0; j < a.n; ++j) std::swap(a(k, j), a(pivot, j));
      for (int j = 0; j < b.m; ++j) std::swap(b(k, j), b(pivot, j));
      for (int i = 0; i < a.n; ++i) {
         const double by = i == k ? 0 : a(i, k)/a(k, k);
         if (by == 0) continue;
         for (int j = k; j < a.n; ++j) a(i, j) -= by*a(k, j);
         for (int j = 0; j < b.m; ++j) b(i, j) -= by*b(k, j);
      }
   }
   for (int i = 0; i < a.n; ++i)
      for (int j = 0; j < b.m; ++j) b(i, j) /= a(i, i);
}

Matrix dense(const emcon_csr &rows)
{
   Matrix found(rows.n_row, rows.n_column);
   for (int i = 0; i < rows.n_row; ++i)
      for (int k = rows.row_start[i]; k < rows.row_start[i + 1]; ++k) found(i, rows.column[k]) = rows.value[k];
   return found;
}

Vector times(Matrix &a, const double *x)
{
   Vector y(static_cast<std::size_t>(a.n));
   for (int i = 0; i < a.n; ++i)
      for (int j = 0; j < a.m; ++j) y[i] += a(i, j)*x[j];
   return y;
}

// A half of x . (a x).
double half(Matrix &a, const double *x)
{
   const Vector y = times(a, x);
   double sum = 0;
   for (int i = 0; i < a.n; ++i) sum += 0.5*x[i]*y[i];
   return sum;
}

struct Host {
   emcon::Model face;
   Matrix stiffness{N_DOF, N_DOF}, mass{N_DOF, N_DOF};
   Vector u = Vector(N_ALL), v = Vector(N_ALL);
   std::vector<int> active;
   double lost = 0;
   int n_status[3] = {0, 0, 0};

   explicit Host(const Vector &x) : face(emcon::Model::of_nodes(x, 3)) {}
   double energy() { return half(mass, &v[3*N_PLATE]) + half(stiffness, &u[3*N_PLATE]) + lost; }

   // Newton's method with all n candidates: the motion, and the multipliers that obey their laws.
   Vector newton(Vector &du, int n)
   {
      Vector lam(static_cast<std::size_t>(n));
      for (int iteration = 0; iteration < 30; ++iteration) {
         emcon_constraint_report rows;
         emcon_csr second;
         face.call(emcon_evaluate_contact, N_PLATE + N_NODE, u.data(), du.data(), &rows);
         Matrix g = dense(rows.discrete_gradient), c = dense(rows.end_gradient), b(N_DOF, n + 1), tangent = mass;
         const Vector defect(rows.defect, rows.defect + n);
         face.call(emcon_curvature, n, lam.data(), &second);
         Matrix curvature = dense(second);
         Vector inertia(N_DOF), mean(N_DOF);
         for (int i = 0; i < N_DOF; ++i) {
            inertia[i] = 2/H*(du[3*N_PLATE + i]/H - v[3*N_PLATE + i]);
            mean[i] = u[3*N_PLATE + i] + 0.5*du[3*N_PLATE + i];
         }
         const Vector by_mass = times(mass, inertia.data()), by_stress = times(stiffness, mean.data());
         for (std::size_t i = 0; i < tangent.size(); ++i)
            tangent[i] = 2/(H*H)*mass[i] + 0.5*stiffness[i] - curvature[i];
         for (int i = 0; i < N_DOF; ++i) {
            for (int k = 0; k < n; ++k) b(i, k) = g(k, i);
            b(i, n) = by_mass[i] + by_stress[i];
         }
         solve(tangent, b);
         Matrix w(n, n);
         Vector opening(defect);
         for (int k = 0; k < n; ++k)
            for (int i = 0; i < N_DOF; ++i) {
               for (int l = 0; l < n; ++l) w(k, l) += c(k, i)*b(i, l);
               opening[k] -= c(k, i)*b(i, n);
            }
         if (n > 0) face.call(emcon_solve_contacts, n, w.data(), opening.data(), lam.data());
         double largest = 0;
         for (int i = 0; i < N_DOF; ++i) {
            double motion = -b(i, n);
            for (int k = 0; k < n; ++k) motion += b(i, k)*lam[k];
            du[3*N_PLATE + i] += motion;
            largest = std::max(largest, std::fabs(motion));
         }
         if (largest < 1e-14) return lam;
      }
      throw std::runtime_error("Newton's method does not converge");
   }

   void step()
   {
      Vector du(N_ALL), stop(N_ALL), slip(2*active.size()), friction(2*active.size());
      std::vector<int> status(active.size());
      for (int i = 0; i < N_ALL; ++i) stop[i] = 0.5*(du[i] = H*v[i]);
      face.solve_step(u, du, active, stop, [this](Vector &motion, int n) { return newton(motion, n); });
      face.call(emcon_get_slips, static_cast<int>(active.size()), status.data(), slip.data(), friction.data());
      for (int way : status) ++n_status[way];
      for (std::size_t i = 0; i < slip.size(); ++i) lost += slip[i]*friction[i];
      for (int i = 0; i < N_ALL; ++i) {
         u[i] += du[i];
         v[i] = 2/H*du[i] - v[i];
      }
   }
};

// Nodes of the plate, then those of the block; faces of each.
Host made(bool is_mortar, double friction)
{
   Vector x{-2, -2, 0, 2, -2, 0, 2, 2, 0, -2, 2, 0};
   for (int i = 0; i <= N; ++i)
      for (int j = 0; j <= N; ++j)
         for (int k = 0; k < 2; ++k) x.insert(x.end(), {i*SIZE - 0.5, j*SIZE - 0.5, 0.02 + k*HIGH});
   Host host(x);
   std::vector<int> sole;
   for (int cell = 0; cell < N*N; ++cell) {
      const int i = cell/N, j = cell%N;
      for (int corner : {node(i, j, 0), node(i, j + 1, 0), node(i + 1, j + 1, 0), node(i + 1, j, 0)})
         sole.push_back(N_PLATE + corner);
   }
   const int quadrilateral = 9, master = host.face.add_faces("plate", quadrilateral, 4, {0, 1, 2, 3});
   const int slave = host.face.add_faces("sole", quadrilateral, 4, sole);
   emcon_pair_options options{};
   options.friction = friction;
   host.face.call(emcon_add_pair, slave, master, is_mortar ? EMCON_MORTAR : EMCON_NODE_TO_SEGMENT, &options);
   host.face.build();
   std::vector<int> start(N_ALL + 1), column;
   for (int i = 0; i < N_ALL; ++i) {
      if (i >= 3*N_PLATE) column.push_back(i - 3*N_PLATE);
      start[i + 1] = static_cast<int>(column.size());
   }
   const Vector one(column.size(), 1.0);
   const emcon_csr map{N_ALL, N_DOF, start.data(), column.data(), one.data()};
   host.face.call(emcon_set_map, &map);
   assemble(host.stiffness, host.mass);
   host.active.resize(static_cast<std::size_t>(host.face.sizes().n_constraint));
   for (int i = 0; i < N_NODE; ++i) {
      const double velocity[3] = {0.8, 0.3 + 0.4*x[3*(N_PLATE + i)], -0.5 + 0.2*x[3*(N_PLATE + i) + 1]};
      std::copy(velocity, velocity + 3, &host.v[3*(N_PLATE + i)]);
   }
   return host;
}

int main(int argc, char **argv)
{
   if (argc != 4) return 2;
   Host host = made(std::string(argv[1]) == "mortar", std::atof(argv[2]));
   const double start = host.energy();
   double drift = 0;
   for (int k = 0; k < std::atoi(argv[3]); ++k) {
      host.step();
      drift = std::max(drift, std::fabs(host.energy()/start - 1));
   }
   std::printf("energy %.1e lost %.17g stuck %d slid %d\n", drift, host.lost, host.n_status[1], host.n_status[2]);
   for (int i = 3*N_PLATE; i < N_ALL; ++i) std::printf("%.17g\n", host.u[i]);
}
