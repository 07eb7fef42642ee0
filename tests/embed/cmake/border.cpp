// A test of what emcon.hpp does: runs of the ring impact, states kept, functions given, calls of hosts,
// failures and exceptions. An example of a host is blocks.cpp.
//
// usage: border DECK
#include <emcon.hpp>

#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace {

const char *const two_nodes = R"(*NODE
1, 0., 0.
2, 1., 0.
3, 1., 1.
4, 0., 1.
*ELEMENT, TYPE=CPE4, ELSET=ALL
1, 1, 2, 3, 4
*MATERIAL, NAME=M
*DENSITY
1.
*ELASTIC
100., 0.3
*SOLID SECTION, ELSET=ALL, MATERIAL=M
*STEP, NLGEOM
*DYNAMIC, DIRECT
0.1, 1.
*END STEP
)";

struct Mishap : std::runtime_error {
   using std::runtime_error::runtime_error;
};

void require(bool holds, const char *what)
{
   if (!holds) throw std::logic_error(what);
}

// 1/2 k x^2 in the first direction; `n_outside` points of the iteration have no energy.
emcon::PointFunction spring(int &n_outside)
{
   return [&n_outside](int n_point, int n_variable, const double *z, double *value,
                       double *gradient, double *hessian) {
      if (n_outside > 0) {
         n_outside -= 1;
         throw emcon::Outside();
      }
      const double k = 5.0;
      for (int p = 0; p < n_point; ++p) {
         const double x = z[n_variable*p];
         value[p] = 0.5*k*x*x;
         for (int i = 0; i < n_variable; ++i) gradient[n_variable*p + i] = i == 0 ? k*x : 0.0;
         if (!hessian) continue;
         for (int i = 0; i < n_variable*n_variable; ++i)
            hessian[n_variable*n_variable*p + i] = i == 0 ? k : 0.0;
      }
   };
}

void run_the_ring(const std::string &deck)
{
   emcon::Model ring = emcon::Model::open(deck, "h=0.05\nt_end=1.5");
   const emcon::Snapshot start = ring.take_snapshot();
   int n = 0;
   std::size_t n_character = 0;
   ring.run(1e30, [&n](const emcon_increment &, double) { return ++n > 0; },
            [&n_character](const std::string &line) { n_character += line.size(); });
   require(ring.is_done() && n == 30 && n_character > 0, "the run of the deck");
   require(ring.verdict().is_good, "its verdict");
   const emcon::Contact contact = ring.contact();
   require(contact.lam.size() == contact.gap.size() && !contact.lam.empty(), "contacts");
   const std::vector<double> u = ring.displacements();
   emcon::Model moved = std::move(ring);   // what is inside stays where it is
   moved.restore(start);
   moved.run(1e30);
   require(moved.displacements() == u, "the same bits");
   std::printf("%.17g %.17g\n", moved.ledger().total, u[1]);
}

void stop_by_exceptions(const std::string &deck)
{
   emcon::Model ring = emcon::Model::open(deck, "h=0.05\nt_end=1");
   try {
      ring.run(1e30, [](const emcon_increment &, double) { return false; });
      require(false, "a run that is stopped");
   } catch (const emcon::Interrupted &error) {
      require(error.code() == EMCON_ERROR_INTERRUPT, "its code");
   }
   try {
      ring.run(1e30, [](const emcon_increment &, double) -> bool { throw Mishap("progress"); });
      require(false, "an exception in a run");
   } catch (const Mishap &) {
   }
   emcon::Model logged = emcon::Model::open(deck, "h=0.05\nt_end=1");
   try {
      logged.run(1e30, nullptr, [](const std::string &) { throw Mishap("log"); });
      require(false, "an exception in the log");
   } catch (const Mishap &) {
      require(logged.time() < 0.06, "the end of its run");
   }
   try {
      emcon::Model::open("no_such_deck.inp");
      require(false, "a deck that is not there");
   } catch (const emcon::Error &error) {
      require(std::string(error.what()).find("no_such_deck.inp") != std::string::npos, "its text");
   }
   int label = 0;
   try {
      ring.call(emcon_get_labels, 1, &label);
      require(false, "a count that does not fit");
   } catch (const emcon::InputError &) {
   }
}

void give_a_spring()
{
   int n_outside = 0;
   emcon::Model block = emcon::Model::read_text(two_nodes);
   block.give_potential("spring", {0, 1, 2, 3}, spring(n_outside));
   block.build();
   const double before = block.ledger().total;
   n_outside = 1;                          // tried again, then through
   block.advance();
   require(n_outside == 0 && block.time() > 0, "a step that is tried again");
   require(std::abs(block.ledger().total - before) <= 1e-12*before && before > 0, "energy");
   bool throws = false;
   emcon::Model other = emcon::Model::read_text(two_nodes);
   other.give_potential("mishap", {0}, [&throws](int n_point, int n_variable, const double *,
                                                 double *value, double *gradient, double *hessian) {
      if (throws) throw Mishap("potential");
      for (int p = 0; p < n_point; ++p) value[p] = 0.0;
      for (int i = 0; i < n_point*n_variable; ++i) gradient[i] = 0.0;
      for (int i = 0; hessian && i < n_point*n_variable*n_variable; ++i) hessian[i] = 0.0;
   });
   other.build();
   throws = true;
   try {
      other.advance();
      require(false, "an exception in a potential");
   } catch (const Mishap &error) {
      require(std::string(error.what()) == "potential", "that exception");
   }
   throws = false;
   other.advance();                        // the model can go on
}

// The call fails with a text that holds these words.
template <class Call>
void refused(const char *words, Call call)
{
   try {
      call();
   } catch (const emcon::InputError &error) {
      require(std::string(error.what()).find(words) != std::string::npos, words);
      return;
   }
   require(false, words);
}

// A mass on two feet falls on a floor, by the calls for hosts, and what these refuse.
void land_on_a_floor()
{
   std::vector<double> u(8), du{0, 0, 0, 0, 0, -0.2, 0, -0.2};
   const std::vector<double> expected = du;
   std::vector<int> active;
   emcon::Model face = emcon::Model::of_nodes({-1, 0, 1, 0, -0.3, 0.1, 0.3, 0.1});
   refused("no faces of 5 nodes", [&] { face.add_faces("bad", 5, {0, 1, 2, 3, 4}); });
   refused("no node 4", [&] { face.hold({4}); });
   const int floor = face.add_faces("floor", 2, {1, 0}), sole = face.add_faces("sole", 2, {2, 3});
   emcon_contact_settings statics = emcon_contact_settings();
   statics.is_end = 1;
   statics.initiation = EMCON_ADMISSIBLE;
   face.call(emcon_set_contact, &statics);
   face.add_pair(sole, floor, EMCON_NODE_TO_SEGMENT);
   face.hold({0, 1});
   face.build();
   auto towards = [&](const std::vector<double> &at, const emcon_csr &second, int n, double *columns) {
      emcon::each(second, [](std::size_t, std::size_t, double value) { require(value == 0, "a straight floor"); });
      for (int i = 0; i < 4; ++i) columns[4*(n - 1) + i] += at[4 + i] - expected[4 + i];
   };
   face.set_free_unknowns();
   try {
      face.solve_step(u, du, active, {}, [](const std::vector<double> &, const emcon_csr &, int, double *) { throw 17; });
      require(false, "what the host's equations throw is thrown");
   } catch (int thrown) {
      require(thrown == 17 && du == expected, "it is thrown again, and nothing has moved");
   }
   const std::vector<double> lam = face.solve_step(u, du, active, {}, towards);
   for (int i = 0; i < 8; ++i) require(std::abs(du[i] - 0.5*expected[i]) < 1e-15, "the feet stand on the floor");
   for (double force : lam) require(std::abs(force - 0.1) < 1e-15, "it holds each with what the host lacks");
   require(active.size() == 2 && active[0] && active[1] && face.slips().loss() == 0, "both of them, without friction");
   active.resize(3);
   refused("n_constraint is 3", [&] { face.solve_step(u, du, active, {}, towards); });
   active.resize(2);
   refused("du or stop has 6 numbers, but the model has 8",
           [&] { face.solve_step(u, du, active, std::vector<double>(6), towards); });
}

// Two masses with damping between them and the floor: it takes what is missing from the energy.
void bounce_with_damping()
{
   const double h = 0.02;
   emcon::Model face = emcon::Model::of_nodes({-1, 0, 1, 0, -0.3, 0.1, 0.3, 0.1});
   const int floor = face.add_faces("floor", 2, {1, 0}), sole = face.add_faces("sole", 2, {2, 3});
   emcon_pair_options damped = emcon_pair_options();
   damped.damping = 2;
   damped.damping_clearance = 0.05;
   face.call(emcon_add_pair, sole, floor, static_cast<int>(EMCON_NODE_TO_SEGMENT), &damped);
   face.hold({0, 1});
   face.build();
   face.set_free_unknowns();
   std::vector<double> u(8), v{0, 0, 0, 0, 0, -1, 0, -1}, du, push(8);
   std::vector<int> active;
   double taken = 0, part = 0;
   auto solve = [&](const std::vector<double> &at, const emcon_csr &second, int n, double *columns) {
      std::vector<double> k(4, 2/(h*h));     // the floor is straight: nothing couples the masses
      emcon::each(second, [&](std::size_t i, std::size_t j, double value) {
         require(i == j || value == 0, "damping along the normal");
         if (i == j) k[i] -= value;
      });
      for (int i = 0; i < 4; ++i) columns[4*(n - 1) + i] += 2/h*(at[4 + i]/h - v[4 + i]);
      for (int i = 0; i < 4*n; ++i) columns[i] /= k[i%4];
   };
   for (int step = 0; step < 20; ++step) {
      du = v;
      for (double &motion : du) motion *= h;
      if (step == 4) refused("the size of the step is to be told",
                             [&] { face.solve_step(u, du, active, {}, solve); });
      face.solve_step(u, du, active, {}, solve, h);
      face.call(emcon_law_forces, 4, push.data(), &part);
      taken += part;
      for (int i = 0; i < 8; ++i) {
         u[i] += du[i];
         v[i] = 2/h*du[i] - v[i];
      }
   }
   double energy = 0;
   for (double part_of : v) energy += 0.5*part_of*part_of;
   require(v[5] > 0 && taken > 0.01 && std::abs(energy + taken - 1) < 1e-13, "energy and damping");
}

}  // namespace

int main(int argc, char **argv)
{
   static_assert(!std::is_copy_constructible<emcon::Model>::value, "a model is not copied");
   if (argc < 2) return 2;
   require(std::string(emcon_status_text(EMCON_OK)) == "done", "text of a code");
   run_the_ring(argv[1]);
   stop_by_exceptions(argv[1]);
   give_a_spring();
   land_on_a_floor();
   bounce_with_damping();
   return 0;
}
