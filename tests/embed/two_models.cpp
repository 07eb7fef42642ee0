// Two models in two threads give the bits of one after the other.
//
// usage: two_models DECK
#include <emcon.h>

#include <cstdio>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace {

class Model {
public:
   Model(const std::string &deck, const std::string &parameters)
   {
      const int status = emcon_open(deck.c_str(), parameters.c_str(), 0, &model_);
      if (status == EMCON_OK) return;
      const std::string text = emcon_message(model_);
      emcon_close(model_);
      throw std::runtime_error(text);
   }
   Model(const Model &) = delete;
   Model &operator=(const Model &) = delete;
   ~Model() { emcon_close(model_); }

   std::vector<double> run()
   {
      check(emcon_run(model_, 1e30, nullptr, nullptr, nullptr));
      emcon_sizes sizes;
      check(emcon_get_sizes(model_, &sizes));
      std::vector<double> u(2*static_cast<std::size_t>(sizes.n_node));
      check(emcon_get_state(model_, sizes.n_node, u.data(), nullptr));
      return u;
   }

private:
   void check(int status)
   {
      if (status != EMCON_OK) throw std::runtime_error(emcon_message(model_));
   }
   emcon_model *model_ = nullptr;
};

}  // namespace

int main(int argc, char **argv)
{
   if (argc < 2) return 2;
   int major, minor, patch;
   emcon_version(&major, &minor, &patch);
   if (major != EMCON_VERSION_MAJOR || minor != EMCON_VERSION_MINOR) return 3;
   const std::vector<std::string> parameters = {"h=0.05\nt_end=1.5", "h=0.02\nt_end=1"};
   std::vector<std::vector<double>> alone, together(parameters.size());
   for (const std::string &text : parameters) alone.push_back(Model(argv[1], text).run());
   std::vector<std::thread> threads;
   for (std::size_t i = 0; i < parameters.size(); ++i)
      threads.emplace_back([&, i] { together[i] = Model(argv[1], parameters[i]).run(); });
   for (std::thread &thread : threads) thread.join();
   if (together != alone) return 1;
   try {
      Model("no_such_deck.inp", "");
   } catch (const std::runtime_error &error) {
      std::printf("%s\n", error.what());
      return 0;
   }
   return 1;
}
