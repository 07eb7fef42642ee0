// An elastic block lands askew on a plate and rubs over it, in space: a small finite element code in
// plain C++ that takes contact with friction from EMCON. Linear hexahedra, consistent mass, steps that
// keep the energy, a dense solver. The plate is held: unknowns are the freedoms of the block.
//
// blocks nodes|mortar FRICTION N_STEP prints what came of it, then the displacements of the block.
#include <emcon.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

using Vector = std::vector<double>;
const int N = 3, N_NODE = (N + 1)*(N + 1)*2, N_DOF = 3*N_NODE, N_PLATE = 4, FIRST = 3*N_PLATE, N_ALL = FIRST + N_DOF;
const double LAME[2] = {60, 40}, H = 0.02, SIZE[3] = {1.0/N, 1.0/N, 0.4};
using Matrix = std::vector<std::array<double, N_DOF>>;

// The integral over a cell of shape functions a and b, a by direction i, b by direction j; -1: not derived.
double integral(int a, int b, int i, int j)
{
   double product = 1;
   for (int d = 0; d < 3; ++d) {
      const double sign_a = (a >> d & 1) ? 1 : -1, sign_b = (b >> d & 1) ? 1 : -1;
      if (d == i && d == j) product *= sign_a*sign_b/SIZE[d];
      else if (d == i || d == j) product *= 0.5*(d == i ? sign_a : sign_b);
      else product *= SIZE[d]*(sign_a == sign_b ? 1.0/3 : 1.0/6);
   }
   return product;
}

// The first freedom at corner a of a cell; nodes are numbered along z, then y, then x.
int freedom(int cell, int a) { return 6*((cell/N + (a & 1))*(N + 1) + cell%N + (a >> 1 & 1)) + 3*(a >> 2); }

// Stiffness and mass of the block, N x N cells of one layer.
void assemble(Matrix &stiffness, Matrix &mass)
{
   for (int cell = 0; cell < N*N; ++cell)
      for (int a = 0; a < 8; ++a)
         for (int b = 0; b < 8; ++b)
            for (int i = 0; i < 3; ++i) {
               const int row = freedom(cell, a) + i, column = freedom(cell, b);
               mass[row][column + i] += integral(a, b, -1, -1);
               for (int j = 0; j < 3; ++j) {
                  stiffness[row][column + j] += LAME[0]*integral(a, b, i, j) + LAME[1]*integral(a, b, j, i);
                  stiffness[row][column + i] += LAME[1]*integral(a, b, j, j);
               }
            }
}

// The n columns of b, one after the other, become those of a^-1 b: elimination with pivots.
void solve(Matrix a, double *b, int n)
{
   for (int k = 0; k < N_DOF; ++k) {
      int pivot = k;
      for (int i = k; i < N_DOF; ++i)
         if (std::fabs(a[i][k]) > std::fabs(a[pivot][k])) pivot = i;
      std::swap(a[k], a[pivot]);
      for (int j = 0; j < n; ++j) std::swap(b[j*N_DOF + k], b[j*N_DOF + pivot]);
      for (int i = 0; i < N_DOF; ++i) {
         const double by = i == k ? 0 : a[i][k]/a[k][k];
         for (int j = k; j < N_DOF; ++j) a[i][j] -= by*a[k][j];
         for (int j = 0; j < n; ++j) b[j*N_DOF + i] -= by*b[j*N_DOF + k];
      }
   }
   for (int i = 0; i < n*N_DOF; ++i) b[i] /= a[i%N_DOF][i%N_DOF];
}

// Nodes of the plate, then those of the block.
Vector places()
{
   Vector x{-2, -2, 0, 2, -2, 0, 2, 2, 0, -2, 2, 0};
   for (int i = 0; i <= N; ++i)
      for (int j = 0; j <= N; ++j)
         for (int k = 0; k < 2; ++k) x.insert(x.end(), {i*SIZE[0] - 0.5, j*SIZE[1] - 0.5, 0.02 + k*SIZE[2]});
   return x;
}

struct Host {
   emcon::Model face = emcon::Model::of_nodes(places(), 3);
   Matrix stiffness = Matrix(N_DOF), mass = Matrix(N_DOF);
   Vector u = Vector(N_ALL), v = Vector(N_ALL);
   std::vector<int> active;
   double lost = 0;
   int n_status[3] = {0, 0, 0};

   Host(int formulation, double friction)
   {
      assemble(stiffness, mass);
      std::vector<int> sole;
      for (int cell = 0; cell < N*N; ++cell)
         for (int a : {0, 2, 3, 1}) sole.push_back(N_PLATE + freedom(cell, a)/3);
      const int slave = face.add_faces("sole", 4, sole), master = face.add_faces("plate", 4, {0, 1, 2, 3});
      face.add_pair(slave, master, formulation, friction);
      face.hold({0, 1, 2, 3});
      face.build();
      face.set_free_unknowns();
      const Vector x = face.positions();
      for (int i = FIRST; i < N_ALL; ++i)
         v[i] = i%3 == 0 ? 0.8 : i%3 == 1 ? 0.3 + 0.4*x[i - 1] : -0.5 + 0.2*x[i - 1];
   }

   // Of motion and strain, and what friction took.
   double energy()
   {
      double sum = lost;
      for (int i = 0; i < N_DOF; ++i)
         for (int j = 0; j < N_DOF; ++j)
            sum += 0.5*(v[FIRST + i]*mass[i][j]*v[FIRST + j] + u[FIRST + i]*stiffness[i][j]*u[FIRST + j]);
      return sum;
   }

   void step()
   {
      Vector du(N_ALL), stop(N_ALL);
      for (int i = 0; i < N_ALL; ++i) stop[i] = 0.5*(du[i] = H*v[i]);
      auto correct = [&](const Vector &at, const emcon_csr &second, int n, double *columns) {
         Matrix tangent(N_DOF);
         for (int i = 0; i < N_DOF; ++i) {
            double &residual = columns[(n - 1)*N_DOF + i];
            for (int j = 0, k = FIRST; j < N_DOF; ++j, ++k) {
               residual += mass[i][j]*2/H*(at[k]/H - v[k]) + stiffness[i][j]*(u[k] + 0.5*at[k]);
               tangent[i][j] = 2/(H*H)*mass[i][j] + 0.5*stiffness[i][j];
            }
         }
         emcon::each(second, [&](std::size_t i, std::size_t j, double value) { tangent[i][j] -= value; });
         solve(tangent, columns, n);
      };
      face.solve_step(u, du, active, stop, correct);
      const emcon::Slips slips = face.slips();
      for (int way : slips.way) ++n_status[way];
      lost += slips.loss();
      for (int i = 0; i < N_ALL; ++i) {
         u[i] += du[i];
         v[i] = 2/H*du[i] - v[i];
      }
   }
};

int main(int argc, char **argv)
{
   if (argc != 4) return 2;
   Host host(std::string(argv[1]) == "mortar" ? EMCON_MORTAR : EMCON_NODE_TO_SEGMENT, std::stod(argv[2]));
   double start = host.energy(), drift = 0;
   for (int k = 0; k < std::stoi(argv[3]); ++k) {
      host.step();
      drift = std::max(drift, std::fabs(host.energy()/start - 1));
   }
   std::printf("energy %.1e lost %.17g stuck %d slid %d\n", drift, host.lost, host.n_status[1], host.n_status[2]);
   for (int i = FIRST; i < N_ALL; ++i) std::printf("%.17g\n", host.u[i]);
}
