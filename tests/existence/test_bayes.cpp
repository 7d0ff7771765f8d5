// The recursion against Bayes' rule over all hidden variables, written out.
#include <array>
#include <vector>

#include "common/existence/point.hpp"
#include "tests/catch.hpp"
#include "tests/existence/existence_scene.hpp"

using namespace understory;
using namespace understory::existence;
using test::IcosahedralPoint;
using test::look_from_face;

namespace {

/// All states (E, D, V of four faces) with their probabilities.
class SlowBayes {
 public:
  SlowBayes(double prior, double v, double w) {
    for (int state = 0; state < kStates; ++state) {
      double p = exists(state) ? prior : 1.0 - prior;
      p *= can_see(state) ? v : 1.0 - v;
      for (int face = 0; face < 4; ++face) p *= is_free(state, face) ? w : 1.0 - w;
      states_[static_cast<std::size_t>(state)] = p;
    }
  }
  void look(int face, bool is_hit, double recall, double eps) {
    for (int state = 0; state < kStates; ++state) {
      const bool is_visible = exists(state) && can_see(state) && is_free(state, face);
      const double q = is_visible ? eps + (1.0 - eps) * recall : eps;
      states_[static_cast<std::size_t>(state)] *= is_hit ? q : 1.0 - q;
    }
  }
  double exists() const {
    double there = 0.0, all = 0.0;
    for (int state = 0; state < kStates; ++state) {
      all += states_[static_cast<std::size_t>(state)];
      if (exists(state)) there += states_[static_cast<std::size_t>(state)];
    }
    return there / all;
  }
  /// p(D | E).
  double pass_sees() const {
    double sees = 0.0, there = 0.0;
    for (int state = 0; state < kStates; ++state) {
      if (!exists(state)) continue;
      there += states_[static_cast<std::size_t>(state)];
      if (can_see(state)) sees += states_[static_cast<std::size_t>(state)];
    }
    return sees / there;
  }

 private:
  static constexpr int kStates = 64;
  static bool exists(int state) { return (state & 1) != 0; }
  static bool can_see(int state) { return (state & 2) != 0; }
  static bool is_free(int state, int face) { return (state >> (2 + face) & 1) != 0; }
  std::array<double, kStates> states_{};
};

}  // namespace

TEST_CASE("Within a pass the recursion is Bayes' rule", "[existence]") {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int trial = 0; trial < 500; ++trial) {
    Parameters parameters = test::plain_parameters();
    parameters.prior = 0.05 + 0.9 * unit(random);
    parameters.pass_recall = 0.3 + 0.7 * unit(random);
    parameters.visibility = 0.95;
    parameters.recall = 0.3 + 0.6 * unit(random);
    parameters.false_rate = 0.001 + 0.1 * unit(random);
    ExistenceModel model(parameters);
    auto point = IcosahedralPoint::known(model);
    SlowBayes slow(parameters.prior, parameters.pass_recall, parameters.visibility);
    // Hits last in a face: their visibility is kept below 0.95, which Bayes' rule does not do.
    const int looks = 1 + static_cast<int>(10.0 * unit(random));
    for (int i = 0; i < looks; ++i) {
      const int face = static_cast<int>(3.99 * unit(random));
      point.miss(model, look_from_face(face));
      slow.look(face, false, parameters.recall, parameters.false_rate);
    }
    const bool ends_with_hit = unit(random) < 0.5;
    if (ends_with_hit) {
      point.hit(model, look_from_face(1));
      slow.look(1, true, parameters.recall, parameters.false_rate);
    }
    REQUIRE(point.probability() == Approx(slow.exists()).epsilon(1e-3).margin(1.1e-6));
    REQUIRE(point.pass_visibility() == Approx(slow.pass_sees()).epsilon(2e-3).margin(1e-3));
  }
}

TEST_CASE("Points drawn from the model: stated probabilities are frequencies", "[existence]") {
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  constexpr int kBins = 5;
  std::array<double, kBins> stated{}, there{}, count{};
  double brier = 0.0;
  constexpr int kPoints = 20000;
  for (int trial = 0; trial < kPoints; ++trial) {
    Parameters parameters = test::plain_parameters();
    parameters.prior = 0.6;
    parameters.pass_recall = 0.7;
    ExistenceModel model(parameters);
    auto point = IcosahedralPoint::known(model);
    const bool exists = unit(random) < 0.6;
    const bool sees = unit(random) < 0.7;
    std::array<bool, 3> is_free{};
    for (bool& free : is_free) free = unit(random) < 0.95;
    for (int i = 0; i < 6; ++i) {
      const auto face = static_cast<std::size_t>(i / 2);
      const bool is_hit =
          unit(random) < 0.01 || (exists && sees && is_free[face] && unit(random) < 0.9);
      const Look look = look_from_face(static_cast<int>(face));
      if (is_hit)
        point.hit(model, look);
      else
        point.miss(model, look);
    }
    const double p = point.probability();
    const auto bin = static_cast<std::size_t>(std::min(kBins - 1, static_cast<int>(p * kBins)));
    stated[bin] += p;
    there[bin] += exists ? 1.0 : 0.0;
    count[bin] += 1.0;
    brier += (p - (exists ? 1.0 : 0.0)) * (p - (exists ? 1.0 : 0.0)) / kPoints;
  }
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    if (count[bin] < 50.0) continue;
    const double frequency = there[bin] / count[bin];
    const double sigma = std::sqrt(0.25 / count[bin]);
    CHECK(std::abs(frequency - stated[bin] / count[bin]) < 4.0 * sigma + 0.01);
  }
  CHECK(brier < 0.13);  // of the 58 % not seen, 31 % are there: 0.58 x 0.31 x 0.69 at best
}
