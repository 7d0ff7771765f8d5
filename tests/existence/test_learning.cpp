// What is learned from drives that come back: recall, decay, births; and the calibration that
// follows.
#include <vector>

#include "common/existence/neighbours.hpp"
#include "common/existence/point.hpp"
#include "tests/catch.hpp"
#include "tests/existence/existence_scene.hpp"

using namespace understory;
using namespace understory::existence;
using test::IcosahedralPoint;
using test::look_from_face;

namespace {

/// A world of points that come back in pass after pass; some go between passes.
struct PassWorld {
  double recall = 0.65;
  double pass_recall = 0.64;
  double gone_per_pass = 0.05;
  double false_rate = 0.01;
  int looks = 15;
  double gap_s = 1e6;
};

struct PassPoint {
  IcosahedralPoint point;
  bool exists = true;
  double ideal = 0.999;  ///< P of Bayes' filter with the true rates.
};

/// P after a pass with so many hits and misses; before it some points went.
double ideal_after(const PassWorld& world, double p, int hits) {
  const double before = p * (1.0 - world.gone_per_pass);
  const double q = world.false_rate + (1.0 - world.false_rate) * world.recall;
  const double seen = std::pow(q, hits) * std::pow(1.0 - q, world.looks - hits);
  const double chance =
      std::pow(world.false_rate, hits) * std::pow(1.0 - world.false_rate, world.looks - hits);
  const double there = world.pass_recall * seen + (1.0 - world.pass_recall) * chance;
  return before * there / (before * there + (1.0 - before) * chance);
}

class PassRun {
 public:
  PassRun(const PassWorld& world, const Parameters& parameters, int points, std::uint64_t seed)
      : world_(world), model_(parameters), random_(seed) {
    for (int i = 0; i < points; ++i)
      points_.push_back({IcosahedralPoint::born(model_, look_from_face(i % kFaces))});
    look(true);
  }
  /// `rounds` of reconsider() before the looks.
  void pass(int rounds = 0) {
    model_.begin_pass();
    enter_pass();
    for (int round = 0; round < rounds; ++round)
      for (PassPoint& one : points_) one.point.reconsider(model_);
    look(false);
  }
  /// What all histories say is applied before the looks and after them.
  void learning_pass() {
    model_.begin_drive();
    enter_pass();
    learn();
    look(false);
    learn();
  }
  void learn() {
    PassHistories histories;
    for (const PassPoint& one : points_) one.point.tell(histories);
    model_.learn(histories);
    for (PassPoint& one : points_) one.point.reconsider(model_);
  }
  PassWorld& world() { return world_; }
  /// Of what is there.
  double wrongly_below(double probability) const {
    double there = 0.0, below = 0.0;
    for (const PassPoint& one : points_) {
      if (!one.exists) continue;
      there += 1.0;
      below += one.point.probability() < probability ? 1.0 : 0.0;
    }
    return below / there;
  }
  double brier() const {
    return brier_of([](const PassPoint& one) { return one.point.probability(); });
  }
  double ideal_brier() const {
    return brier_of([](const PassPoint& one) { return one.ideal; });
  }
  const ExistenceModel& model() const { return model_; }
  const std::vector<PassPoint>& points() const { return points_; }

 private:
  template <typename P>
  double brier_of(const P& probability) const {
    double sum = 0.0;
    for (const PassPoint& one : points_) {
      const double error = probability(one) - (one.exists ? 1.0 : 0.0);
      sum += error * error;
    }
    return sum / static_cast<double>(points_.size());
  }
  void enter_pass() {
    for (PassPoint& one : points_) {
      if (unit() < world_.gone_per_pass) one.exists = false;
      one.point.elapse(model_, model_.elapsed(world_.gap_s));
    }
    for (PassPoint& one : points_) one.point.enter_pass(model_);
  }
  double unit() { return std::uniform_real_distribution<double>(0.0, 1.0)(random_); }
  void look(bool is_first) {
    for (PassPoint& one : points_) {
      const bool can_see = one.exists && (is_first || unit() < world_.pass_recall);
      const int start = static_cast<int>(unit() * kFaces);
      int hits = 0;
      for (int i = 0; i < world_.looks; ++i) {
        const bool is_hit = unit() < world_.false_rate || (can_see && unit() < world_.recall);
        const Look look = look_from_face((start + i / 5) % kFaces);
        hits += is_hit ? 1 : 0;
        if (is_hit)
          one.point.hit(model_, look);
        else
          one.point.miss(model_, look);
      }
      if (!is_first) one.ideal = ideal_after(world_, one.ideal, hits);
    }
  }

  PassWorld world_;
  ExistenceModel model_;
  std::mt19937_64 random_;
  std::vector<PassPoint> points_;
};

}  // namespace

TEST_CASE("Recall of looks and of passes is learned, whatever it was thought to be",
          "[existence]") {
  const double wrong = GENERATE(-0.2, 0.0, 0.2);
  PassWorld world;
  world.gone_per_pass = 0.02;
  Parameters parameters;
  parameters.decay_per_s = 2e-8;
  parameters.decay_weight = 2.0;
  parameters.recall = std::min(0.95, world.recall + wrong);
  parameters.pass_recall = std::min(0.95, world.pass_recall + wrong);
  PassRun run(world, parameters, 400, 21);
  for (int pass = 0; pass < 8; ++pass) run.pass();
  CHECK(run.model().recall().at(10.0) == Approx(world.recall).margin(0.03));
  CHECK(run.model().recall().of_pass() == Approx(world.pass_recall).margin(0.05));
  CHECK(run.brier() <= run.ideal_brier() + 0.01);
}

TEST_CASE("What a pass has taught is applied to the passes before it", "[existence]") {
  PassWorld world;
  world.pass_recall = 0.5;
  world.gone_per_pass = 0.02;
  Parameters parameters;
  parameters.pass_recall = 0.9;  // far off: a missed pass is taken for a lost point
  parameters.decay_per_s = 5e-8;
  parameters.decay_weight = 2.0;
  PassRun plain(world, parameters, 1500, 26);
  PassRun settled(world, parameters, 1500, 26);
  for (int pass = 0; pass < 4; ++pass) {
    plain.pass();
    settled.pass(10);
  }
  CHECK(settled.model().recall().of_pass() == Approx(0.5).margin(0.05));
  CHECK(settled.brier() < plain.brier());
  CHECK(settled.brier() <= settled.ideal_brier() + 0.01);
}

TEST_CASE("Passes that miss two thirds take nothing out that stands", "[existence]") {
  constexpr double kYear_s = 365.25 * 86400.0;
  PassWorld world;
  world.pass_recall = 0.34;
  world.gone_per_pass = GENERATE(0.0, 0.05);
  world.gap_s = 6.0 * kYear_s;
  Parameters parameters;
  parameters.decay_per_s = 8e-10;
  parameters.decay_weight = 20.0;
  PassRun run(world, parameters, 1500, 27);
  for (int pass = 0; pass < 5; ++pass) {
    run.learning_pass();
    CAPTURE(pass, run.model().recall().of_pass(), run.model().decay().mean_per_s());
    CHECK(run.wrongly_below(0.1) == 0.0);
    CHECK(run.brier() <= run.ideal_brier() + 0.06);
    // Others a day later, when nothing goes.
    run.world().gap_s = 86400.0;
    run.world().gone_per_pass = 0.0;
  }
  CHECK(run.model().recall().of_pass() == Approx(0.34).margin(0.05));
}

TEST_CASE("What a pass teaches is applied to that pass", "[existence]") {
  PassWorld world;
  world.pass_recall = 0.3;
  world.gone_per_pass = 0.0;
  world.gap_s = 86400.0;
  Parameters parameters;
  parameters.pass_recall = 0.9;
  parameters.decay_per_s = 2e-8;
  parameters.decay_weight = 20.0;
  ExistenceModel told(parameters);
  told.recall().hold(0.3);
  PassRun run(world, parameters, 500, 28);
  run.learning_pass();
  CHECK(run.model().recall().of_pass() == Approx(0.3).margin(0.05));

  // A point that knew v before it looked, and one that is told afterwards.
  ExistenceModel late(parameters);
  const auto missed = [](ExistenceModel& model) {
    auto point = IcosahedralPoint::known(model);
    point.elapse(model, model.elapsed(86400.0));
    model.begin_pass();
    point.enter_pass(model);
    for (int face = 0; face < 4; ++face) point.miss(model, look_from_face(face));
    return point;
  };
  auto before = missed(told);
  auto after = missed(late);
  CHECK(after.probability() < before.probability() - 0.01);
  late.recall().hold(0.3);
  after.reconsider(late);
  CHECK(after.probability() == Approx(before.probability()).epsilon(1e-3));
  CHECK(after.pass_visibility() == Approx(before.pass_visibility()).epsilon(1e-2));
}

TEST_CASE("Calibration holds with the recall thought 0.2 off", "[existence]") {
  PassWorld world;
  world.pass_recall = 1.0;
  Parameters parameters;
  parameters.decay_per_s = 2e-8;
  parameters.decay_weight = 2.0;
  parameters.pass_recall = 0.97;
  parameters.recall = world.recall + GENERATE(-0.2, 0.2);
  PassRun run(world, parameters, 400, 25);
  for (int pass = 0; pass < 4; ++pass) {
    run.pass();
    CHECK(run.brier() <= 0.03);
  }
}

TEST_CASE("Recall is learned by range", "[existence]") {
  ExistenceModel model{Parameters{}};
  std::mt19937_64 random(220);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int i = 0; i < 4000; ++i) {
    const double distance_m = 40.0 * unit(random);
    model.recall().record_look(distance_m, unit(random) < (distance_m < 20.0 ? 0.9 : 0.5));
  }
  CHECK(model.recall().at(10.0) == Approx(0.9).margin(0.05));
  CHECK(model.recall().at(30.0) == Approx(0.5).margin(0.05));
}

TEST_CASE("The rate of decay is learned from what may have gone", "[existence]") {
  PassWorld world;
  world.pass_recall = 0.8;
  Parameters parameters;
  parameters.decay_per_s = GENERATE(1e-8, 2e-7);
  parameters.decay_weight = 2.0;
  PassRun run(world, parameters, 500, 23);
  for (int pass = 0; pass < 10; ++pass) run.pass();
  const double truth = -std::log(1.0 - world.gone_per_pass) / world.gap_s;
  CHECK(run.model().decay().mean_per_s() == Approx(truth).epsilon(0.2));
  CHECK(run.model().decay().sigma_per_s() < 0.1 * truth);
}

TEST_CASE("Known deaths give the plain rate; what was counted too early is taken back",
          "[existence]") {
  DecayRate rate(1e-3, 1.0);
  for (int i = 0; i < 1000; ++i) {
    const DecayEvidence perhaps{0.3F, 50.0F};
    rate.replace({}, perhaps);
    rate.replace(perhaps, {i < 100 ? 1.0F : 0.0F, 100.0F});
  }
  CHECK(rate.mean_per_s() == Approx(101.0 / (900.0 * 100.0 + 1000.0)));
  DecayRate fixed(1e-3, 0.0);
  fixed.replace({}, {1.0F, 1e6F});
  CHECK(fixed.mean_per_s() == 1e-3);
  CHECK_THROWS_AS(rate.restore(-1.0, 1.0), std::invalid_argument);
}

TEST_CASE("False detections die, and their share is learned", "[existence]") {
  const double false_share = GENERATE(0.1, 0.3);
  ExistenceModel model{Parameters{}};
  std::mt19937_64 random(24);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<IcosahedralPoint> points;
  int false_alive = 0, alive = 0, real = 0, real_alive = 0;
  for (int i = 0; i < 2000; ++i) {
    const bool is_real = unit(random) >= false_share;
    auto point = IcosahedralPoint::born(model, look_from_face(i % kFaces));
    for (int k = 0; k < 20; ++k) {
      const Look look = look_from_face((i + k / 7) % kFaces);
      if (unit(random) < 0.01 || (is_real && unit(random) < 0.85))
        point.hit(model, look);
      else
        point.miss(model, look);
    }
    const bool is_used = point.probability() > 0.5;
    real += is_real ? 1 : 0;
    alive += is_used ? 1 : 0;
    false_alive += is_used && !is_real ? 1 : 0;
    real_alive += is_used && is_real ? 1 : 0;
    points.push_back(point);
  }
  model.begin_pass();
  for (IcosahedralPoint& point : points) point.enter_pass(model);
  CHECK(false_alive <= alive / 100);
  CHECK(real_alive >= real * 99 / 100);
  CHECK(model.birth() == Approx(1.0 - false_share).margin(0.04));
}

namespace {

/// Chance of hypothesis `h` (nothing, cleared, occluded) with this chance before, of the points in
/// `state` and of what was seen of them.
double chance_of(std::size_t h, double prior, unsigned state, const std::vector<double>& before,
                 const std::vector<double>& ratios) {
  const PatchParameters parameters;
  double p = prior;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const double alone = before[i] / (1.0 - parameters.cleared * parameters.gone_in_it);
    const double kept = alone * (h == 1 ? 1.0 - parameters.gone_in_it : 1.0);
    const bool exists = (state >> i & 1U) != 0;
    p *= exists ? kept * (h == 2 ? 1.0 : ratios[i]) : 1.0 - kept;
  }
  return p;
}

}  // namespace

TEST_CASE("A patch is Bayes' rule over what may have come over it", "[existence]") {
  const PatchParameters parameters;
  Patch patch;
  const std::vector<double> before{0.9, 0.8, 0.95};
  const std::vector<double> ratios{0.2, 3.0, 0.05};
  std::vector<PatchMember> members;
  for (std::size_t i = 0; i < 3; ++i) {
    members.push_back(patch.join(odds_of(before[i])));
    patch.update(members[i], odds_of(before[i]) * 0.5, 1U);  // replaced by what follows
    patch.update(members[i], odds_of(before[i]) * ratios[i], 3U);
  }
  // Hypothesis, then which of the three exist: 3 x 8 states.
  const double occluded = parameters.occluded * parameters.also_from;
  const std::vector<double> priors{1.0 - parameters.cleared - parameters.occluded,
                                   parameters.cleared, occluded};
  for (std::size_t target = 0; target < 3; ++target) {
    double there = 0.0, all = 0.0;
    for (std::size_t h = 0; h < 3; ++h) {
      for (unsigned state = 0; state < 8; ++state) {
        const double p = chance_of(h, priors[h], state, before, ratios);
        all += p;
        if ((state >> target & 1U) != 0) there += p;
      }
    }
    CHECK(patch.probability(members[target]) == Approx(there / all).epsilon(1e-9));
  }
}

TEST_CASE("Fifty felled together are found in one pass, twenty behind a lorry stay",
          "[existence]") {
  Parameters parameters = test::plain_parameters();
  parameters.pass_recall = 0.64;
  ExistenceModel model(parameters);
  const auto look_at_patch = [&](int trees, const std::vector<int>& faces, Ray ray) {
    Patch patch;
    std::vector<PatchMember> members;
    for (int i = 0; i < trees; ++i) {
      auto point = IcosahedralPoint::known(model);
      PatchMember member = patch.join(odds_of(point.probability()));
      for (const int face : faces) {
        Look look = look_from_face(face);
        look.ray = ray;
        for (int k = 0; k < 10; ++k) point.miss(model, look);
      }
      patch.update(member, odds_of(point.probability()), point.missed_from());
      members.push_back(member);
    }
    return patch.probability(members.front());
  };
  CHECK(look_at_patch(50, {0, 1, 2, 8}, Ray::kUnknown) < 0.1);
  CHECK(look_at_patch(20, {0}, Ray::kUnknown) > 0.5);
  CHECK(look_at_patch(20, {0, 1, 2, 8}, Ray::kBlocked) > 0.97);
  CHECK(look_at_patch(1, {0, 1, 2, 8}, Ray::kUnknown) > 0.9);
}

TEST_CASE("What was missed before a gap does not say that nothing went in it", "[existence]") {
  // A drive and, a day later, another one; a month later a fifth has gone.
  for (const double recall : {0.64, 0.95}) {
    PassWorld world;
    world.pass_recall = recall;
    world.gone_per_pass = 0.0;
    world.gap_s = 86400.0;
    Parameters parameters;
    parameters.decay_per_s = 1e-7;
    parameters.decay_weight = 2.0;
    PassRun run(world, parameters, 1500, 29);
    run.learning_pass();
    run.world().gone_per_pass = 0.2;
    run.world().gap_s = 30.0 * 86400.0;
    run.learning_pass();
    CAPTURE(recall, run.model().learned().now, run.model().learned().before);
    CHECK(run.model().learned().now == Approx(recall).margin(0.07));
    CHECK(run.brier() < run.ideal_brier() + 0.015);
    if (recall < 0.9) CHECK(run.wrongly_below(0.2) == 0.0);
  }
}
