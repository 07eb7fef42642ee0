// EMCON for C++ (C++11 and later): models that close themselves, failures as exceptions, arrays as
// vectors. This header contains all of it; emcon.h describes each function. Model::call calls the
// functions that have no method here:
//
//    emcon::Model ring = emcon::Model::open("ring.inp", "h=0.05");
//    ring.run(1.0);
//    ring.call(emcon_set_threads, 2);
#ifndef EMCON_HPP
#define EMCON_HPP

#include <emcon.h>

#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace emcon {

// What failed, by its code; its text is that of emcon_message.
class Error : public std::runtime_error {
public:
   Error(int code, const std::string &text) : std::runtime_error(text), code_(code) {}
   int code() const noexcept { return code_; }

private:
   int code_;
};

struct InputError : Error { using Error::Error; };
struct AnalysisError : Error { using Error::Error; };
struct FileError : Error { using Error::Error; };
struct InternalError : Error { using Error::Error; };
struct Interrupted : Error { using Error::Error; };

// Throw this in a law, potential or force for a state without energy: the step is then repeated in
// smaller parts.
struct Outside : std::exception {
   const char *what() const noexcept override { return "there is no energy at this state"; }
};

[[noreturn]] inline void fail(int code, const std::string &text)
{
   switch (code) {
   case EMCON_ERROR_INPUT: throw InputError(code, text);
   case EMCON_ERROR_ANALYSIS: throw AnalysisError(code, text);
   case EMCON_ERROR_FILE: throw FileError(code, text);
   case EMCON_ERROR_INTERRUPT: throw Interrupted(code, text);
   default: throw InternalError(code, text);
   }
}

// Called after each increment with it and the fraction that is done; false stops the run.
using Progress = std::function<bool(const emcon_increment &, double)>;
// Called with each line of the log.
using Log = std::function<void(const std::string &)>;
// An energy at points, as emcon_point_function: n_point, n_variable, z, value, gradient, and
// hessian, which is NULL where it is not wanted.
using PointFunction = std::function<void(int, int, const double *, double *, double *, double *)>;
// Forces of a step, as emcon_force_function: n_node, u0, du, force, magnitude, energy, and tangent,
// which is NULL where it is not wanted.
using ForceFunction = std::function<void(int, const double *, const double *, double *, double *,
                                         double *, double *)>;

// A saved state; it stays valid if its model is closed.
class Snapshot {
public:
   explicit Snapshot(emcon_snapshot *kept) : kept_(kept) {}
   const emcon_snapshot *get() const noexcept { return kept_.get(); }

private:
   struct Free {
      void operator()(emcon_snapshot *kept) const noexcept { emcon_free_snapshot(kept); }
   };
   std::unique_ptr<emcon_snapshot, Free> kept_;
};

struct Verdict {
   bool is_good;
   std::string json;
};

// For each possible contact; the gap is NaN if no surface is near. With *FRICTION its traction and
// slip, vectors of n_dim - 1 components, and the length of its path; `way` is 1 if it sticks, 2 if
// it slides.
struct Contact {
   std::vector<double> lam, pressure, gap, shear, slip, path;
   std::vector<int> is_active, label, pair, way;
};

// For each possible contact in the step of a host: `way` is 0 if it is open, 1 if it acts and does
// not slide, 2 if it slides; slip and friction are vectors of n_dim - 1 components.
struct Slips {
   std::vector<int> way;
   std::vector<double> slip, friction;

   // The energy dissipated by friction in the step.
   double loss() const
   {
      double sum = 0;
      for (std::size_t i = 0; i < slip.size(); ++i) sum += slip[i]*friction[i];
      return sum;
   }
};

// visit(i, j, value) for each entry of a matrix, row by row.
template <class Visit>
void each(const emcon_csr &matrix, Visit visit)
{
   for (int i = 0; i < matrix.n_row; ++i)
      for (int k = matrix.row_start[i]; k < matrix.row_start[i + 1]; ++k)
         visit(static_cast<std::size_t>(i), static_cast<std::size_t>(matrix.column[k]), matrix.value[k]);
}

// A model: moved, not copied; closed at its end.
class Model {
public:
   // ---- reading and building ----

   static Model open(const std::string &deck, const std::string &parameters = "",
                     bool is_lenient = false)
   {
      return made(emcon_open, deck.c_str(), parameters.c_str(), is_lenient);
   }

   // Read without building: give the model its functions, then `build`.
   static Model read(const std::string &deck, const std::string &parameters = "",
                     bool is_lenient = false)
   {
      return made(emcon_read, deck.c_str(), parameters.c_str(), is_lenient);
   }

   static Model read_text(const std::string &text, const std::string &name = "deck",
                          const std::string &parameters = "", bool is_lenient = false)
   {
      return made(emcon_read_text, text.c_str(), name.c_str(), parameters.c_str(), is_lenient);
   }

   static Model load(const std::string &path) { return made(emcon_load, path.c_str()); }

   // A model of a host in the plane, or in space: nodes at the positions x0, y0, x1, y1, ...
   static Model of_nodes(const std::vector<double> &x, int n_dim = 2)
   {
      return made(emcon_new, static_cast<int>(x.size()/static_cast<std::size_t>(n_dim)), n_dim,
                  x.data());
   }

   void build() { call(emcon_build); }
   void resume(const std::string &path) { call(emcon_resume, path.c_str()); }
   void save(const std::string &path) const { call(emcon_save, path.c_str()); }

   // ---- any function of emcon.h with a model and a status ----

   emcon_model *get() const noexcept { return owned_->model; }

   template <class Function, class... Arguments>
   void call(Function function, Arguments &&...arguments) const
   {
      check(function(get(), std::forward<Arguments>(arguments)...));
   }

   // ---- the run of the deck, and steps ----

   emcon_increment advance() { return told(emcon_advance); }

   emcon_increment step(double h)
   {
      emcon_increment made;
      call(emcon_step, h, &made);
      return made;
   }

   // Increments until `time` is reached, or the end of the deck.
   void run(double time, Progress progress = Progress(), Log log = Log())
   {
      Callbacks callbacks{owned_.get(), std::move(progress), std::move(log)};
      check(emcon_run(get(), time, tell, callbacks.log ? write_line : nullptr, &callbacks));
      rethrow();   // what the log threw after the last increment
   }

   void next_step() { call(emcon_next_step); }
   bool is_done() const { return emcon_is_done(get()) != 0; }

   Snapshot take_snapshot() const
   {
      emcon_snapshot *kept = nullptr;
      const int status = emcon_take_snapshot(get(), &kept);
      Snapshot snapshot(kept);
      check(status);
      return snapshot;
   }

   void restore(const Snapshot &snapshot) { call(emcon_restore_snapshot, snapshot.get()); }

   // ---- what a model holds ----

   emcon_sizes sizes() const { return told(emcon_get_sizes); }
   double time() const { return told(emcon_get_time); }
   emcon_ledger ledger() const { return told(emcon_get_ledger); }

   Verdict verdict() const
   {
      int is_good = 0;
      const char *json = nullptr;
      call(emcon_get_verdict, &is_good, &json);
      return {is_good != 0, json};
   }

   std::string notes() const { return text_of(emcon_get_notes); }
   std::string report() const { return text_of(emcon_get_report); }

   std::vector<int> labels() const
   {
      std::vector<int> label(static_cast<std::size_t>(sizes().n_node));
      call(emcon_get_labels, static_cast<int>(label.size()), label.data());
      return label;
   }

   // The sizes().n_dim coordinates of each node, side by side.
   std::vector<double> positions() const
   {
      const emcon_sizes of = sizes();
      std::vector<double> x(n_freedom(of));
      call(emcon_get_positions, of.n_node, x.data());
      return x;
   }

   std::vector<double> displacements() const
   {
      const emcon_sizes of = sizes();
      std::vector<double> u(n_freedom(of));
      call(emcon_get_state, of.n_node, u.data(), nullptr);
      return u;
   }

   std::vector<double> velocities() const
   {
      const emcon_sizes of = sizes();
      std::vector<double> v(n_freedom(of));
      call(emcon_get_state, of.n_node, nullptr, v.data());
      return v;
   }

   // Displacements and velocities; an empty one is left as it is.
   void set_state(const std::vector<double> &u, const std::vector<double> &v)
   {
      if (!u.empty() && !v.empty() && u.size() != v.size())
         throw InputError(EMCON_ERROR_INPUT, "displacements and velocities differ in length");
      const emcon_sizes of = sizes();
      const std::size_t n = u.empty() ? v.size() : u.size();
      if (n != 0 && n != n_freedom(of))
         throw InputError(EMCON_ERROR_INPUT, "the state has " + std::to_string(n)
            + " numbers, but the model has " + std::to_string(n_freedom(of)));
      call(emcon_set_state, of.n_node, u.empty() ? nullptr : u.data(),
           v.empty() ? nullptr : v.data(), 0, nullptr, nullptr, nullptr);
   }

   Contact contact() const
   {
      const int n = sizes().n_contact;
      const std::size_t size = static_cast<std::size_t>(n);
      Contact found;
      for (std::vector<double> *array : {&found.lam, &found.pressure, &found.gap, &found.path})
         array->resize(size);
      found.shear.resize(size*static_cast<std::size_t>(sizes().n_slip));
      found.slip.resize(found.shear.size());
      for (std::vector<int> *array : {&found.is_active, &found.label, &found.pair, &found.way})
         array->resize(size);
      call(emcon_get_contact, n, found.lam.data(), found.is_active.data(), found.label.data(),
           found.pair.data());
      call(emcon_get_pressures, n, found.pressure.data(), found.gap.data());
      call(emcon_get_friction, n, found.shear.data(), found.way.data(), found.slip.data(),
           found.path.data());
      return found;
   }

   // ---- loads and boundary values ----

   int find_load(int kind, int label, int place = 0) const
   {
      int load = 0;
      call(emcon_find_load, kind, label, place, &load);
      return load;
   }

   void set_load(int load, double value) { call(emcon_set_load, load, value); }

   // One load; several at once are faster by emcon_add_loads.
   void add_load(int kind, int label, int place, double value, const double *direction = nullptr)
   {
      call(emcon_add_loads, kind, 1, &label, &place, &value, direction);
   }

   void prescribe(int label, int dof, double value) { call(emcon_prescribe, label, dof, value); }
   void set_free(int label, int dof) { call(emcon_remove_prescribed, label, dof); }

   // ---- contact over the steps of a host, of a model of its nodes ----

   // A surface of faces of one kind, as VTK numbers it, of so many nodes each; its number.
   int add_faces(const std::string &name, int kind, int n_of_face, const std::vector<int> &node)
   {
      const int n = static_cast<int>(node.size())/n_of_face;
      std::vector<int> kinds(static_cast<std::size_t>(n), kind), offset;
      int surface = 0;
      for (int i = 1; i <= n; ++i) offset.push_back(i*n_of_face);
      call(emcon_add_faces, name.c_str(), n, kinds.data(), offset.data(),
           static_cast<int>(node.size()), node.data(), &surface);
      return surface;
   }

   // The same of the kind that so many nodes have: 2 in the plane, else 3, 4, 6 or 8.
   int add_faces(const std::string &name, int n_of_face, const std::vector<int> &node)
   {
      const int n_nodes[] = {2, 3, 4, 6, 8}, kinds[] = {3, 5, 9, 22, 23};
      for (int k = 0; k < 5; ++k)
         if (n_nodes[k] == n_of_face) return add_faces(name, kinds[k], n_of_face, node);
      throw InputError(EMCON_ERROR_INPUT, "there are no faces of " + std::to_string(n_of_face) + " nodes");
   }

   // A pair of surfaces by their numbers; more of it is told by emcon_pair_options.
   void add_pair(int slave, int master, int formulation, double friction = 0)
   {
      emcon_pair_options options = emcon_pair_options();
      options.friction = friction;
      call(emcon_add_pair, slave, master, formulation, &options);
   }

   // Nodes whose displacements the host prescribes.
   void hold(const std::vector<int> &node)
   {
      const emcon_sizes of = sizes();
      std::vector<int> held(n_freedom(of));
      for (int i : node) {
         if (i < 0 || i >= of.n_node)
            throw InputError(EMCON_ERROR_INPUT, "there is no node " + std::to_string(i));
         for (int a = 0; a < of.n_dim; ++a) held[static_cast<std::size_t>(of.n_dim*i + a)] = 1;
      }
      call(emcon_hold, of.n_node, held.data());
   }

   // Use unknowns w of the host from now on: see emcon_set_map.
   void set_map(const emcon_csr &map) { call(emcon_set_map, &map); }

   // The same with the freedoms of the nodes that are neither held (emcon_hold) nor tied to others.
   void set_free_unknowns()
   {
      emcon_csr links;
      call(emcon_links, &links);
      set_map(links);
   }

   // A whole step from the displacements `u0`, by emcon_solve_step; the forces of the gaps. Before it
   // `du` is the expected motion, and `active` has the flags of the step before (empty: nothing acted);
   // after it they are those of this step. `solve(du, second, n, columns)` finds the residual r of the
   // motion du without contact, and its derivative K by the unknowns, from which `second` is
   // subtracted. It adds r to the last of the n columns, which are stored one after the other, and
   // replaces each by K^-1 times it. What it throws ends the step and is thrown again. `stop` is that
   // of emcon_begin_friction, empty: none; `h`, if pairs have damping: the size of the step.
   template <class Solve>
   std::vector<double> solve_step(const std::vector<double> &u0, std::vector<double> &du,
                                  std::vector<int> &active, const std::vector<double> &stop,
                                  Solve solve, double h = 0)
   {
      const emcon_sizes of = sizes();
      for (std::size_t n : {u0.size(), du.size(), stop.empty() ? n_freedom(of) : stop.size()})
         if (n != n_freedom(of))
            throw InputError(EMCON_ERROR_INPUT, "u0, du or stop has " + std::to_string(n)
               + " numbers, but the model has " + std::to_string(n_freedom(of)));
      if (active.empty()) active.resize(static_cast<std::size_t>(of.n_constraint));
      std::vector<double> lam(active.size());
      Equations<Solve> host{owned_.get(), solve};
      call(emcon_solve_step, of.n_node, u0.data(), du.data(), stop.empty() ? nullptr : stop.data(), h,
           static_cast<int>(active.size()), active.data(), lam.data(), equations<Solve>, &host);
      return lam;
   }

   // How contacts stick and slide, by the step that was solved last.
   Slips slips() const
   {
      const emcon_sizes of = sizes();
      const std::size_t n = static_cast<std::size_t>(of.n_constraint);
      Slips found;
      found.way.resize(n);
      found.slip.resize(n*static_cast<std::size_t>(of.n_dim - 1));
      found.friction.resize(found.slip.size());
      call(emcon_get_slips, of.n_constraint, found.way.data(), found.slip.data(), found.friction.data());
      return found;
   }

   // ---- what is given, between reading and building ----

   // An exception of such a function ends the call of the library, which throws it again.

   void give_law(const std::string &name, PointFunction law)
   {
      call(emcon_give_law, name.c_str(), point, keep(owned_->points, std::move(law)));
   }

   void give_potential(const std::string &name, const std::vector<int> &node,
                       PointFunction potential)
   {
      call(emcon_give_potential, name.c_str(), static_cast<int>(node.size()), node.data(), point,
           keep(owned_->points, std::move(potential)));
   }

   void give_force(const std::string &name, const emcon_csr &pattern, ForceFunction force)
   {
      call(emcon_give_force, name.c_str(), &pattern, forces,
           keep(owned_->forces, std::move(force)));
   }

   void give_mass(const emcon_csr &mass) { call(emcon_give_mass, &mass); }

private:
   struct Owned;

   // A function that was given, and the model whose call it may end.
   template <class Function>
   struct Given {
      Owned *owner;
      Function function;
   };

   // Stays where it is when a Model is moved.
   struct Owned {
      emcon_model *model = nullptr;
      std::exception_ptr thrown;
      std::vector<std::unique_ptr<Given<PointFunction>>> points;
      std::vector<std::unique_ptr<Given<ForceFunction>>> forces;
      Owned() = default;
      Owned(const Owned &) = delete;
      Owned &operator=(const Owned &) = delete;
      ~Owned() { emcon_close(model); }
   };

   // The equations of a host, and the model whose step they may end.
   template <class Solve>
   struct Equations {
      Owned *owner;
      Solve &solve;
   };

   struct Callbacks {
      Owned *owner;
      Progress progress;
      Log log;
   };

   Model() : owned_(new Owned) {}
   emcon_model **address() noexcept { return &owned_->model; }
   static std::size_t n_freedom(const emcon_sizes &of)
   {
      return static_cast<std::size_t>(of.n_dim)*static_cast<std::size_t>(of.n_node);
   }

   void rethrow() const
   {
      if (!owned_->thrown) return;
      std::exception_ptr thrown;
      std::swap(thrown, owned_->thrown);
      std::rethrow_exception(thrown);
   }

   void check(int status) const
   {
      if (status == EMCON_OK) return;
      rethrow();
      const char *text = emcon_message(get());
      fail(status, text && *text ? text : emcon_status_text(status));
   }

   // The model that a function makes of what stands before its place.
   template <class Function, class... Arguments>
   static Model made(Function function, Arguments... arguments)
   {
      Model model;
      model.check(function(arguments..., model.address()));
      return model;
   }

   // What a function tells by its only argument.
   template <class Value>
   Value told(int (*function)(emcon_model *, Value *)) const
   {
      Value found = Value();
      call(function, &found);
      return found;
   }

   std::string text_of(int (*function)(emcon_model *, const char **)) const
   {
      const char *text = told(function);
      return text ? text : "";
   }

   template <class Function>
   void *keep(std::vector<std::unique_ptr<Given<Function>>> &kept, Function function)
   {
      kept.emplace_back(new Given<Function>{owned_.get(), std::move(function)});
      return kept.back().get();
   }

   // No exception passes through the library: 1 stands for Outside, 2 for one that is kept.
   template <class Body>
   static int guarded(Owned *owner, Body body) noexcept
   {
      try {
         return body();
      } catch (const Outside &) {
         return 1;
      } catch (...) {
         if (!owner->thrown) owner->thrown = std::current_exception();
         return 2;
      }
   }

   static int point(void *user, int n_point, int n_variable, const double *z, int wants_hessian,
                    double *value, double *gradient, double *hessian)
   {
      auto *given = static_cast<Given<PointFunction> *>(user);
      return guarded(given->owner, [&] {
         given->function(n_point, n_variable, z, value, gradient,
                         wants_hessian ? hessian : nullptr);
         return 0;
      });
   }

   static int forces(void *user, int n_node, const double *u0, const double *du,
                     int wants_tangent, double *force, double *magnitude, double *energy,
                     double *tangent)
   {
      auto *given = static_cast<Given<ForceFunction> *>(user);
      return guarded(given->owner, [&] {
         given->function(n_node, u0, du, force, magnitude, energy,
                         wants_tangent ? tangent : nullptr);
         return 0;
      });
   }

   template <class Solve>
   static int equations(void *user, int n_freedom, const double *du, const emcon_csr *second,
                        int /* n_unknown */, int n_column, double *columns)
   {
      auto *host = static_cast<Equations<Solve> *>(user);
      return guarded(host->owner, [&] {
         host->solve(std::vector<double>(du, du + n_freedom), *second, n_column, columns);
         return 0;
      });
   }

   static int tell(void *user, const emcon_increment *increment, double fraction_done)
   {
      auto *callbacks = static_cast<Callbacks *>(user);
      if (callbacks->owner->thrown) return 1;   // by the log
      if (!callbacks->progress) return 0;
      return guarded(callbacks->owner,
                     [&] { return callbacks->progress(*increment, fraction_done) ? 0 : 1; });
   }

   static void write_line(void *user, const char *line)
   {
      auto *callbacks = static_cast<Callbacks *>(user);
      guarded(callbacks->owner, [&] {
         callbacks->log(line);
         return 0;
      });
   }

   std::unique_ptr<Owned> owned_;
};

}  // namespace emcon

#endif
