// Scores of place recognition against counting by hand, and what the protocols allow.
#include <random>

#include "eval/experiments/place_recognition/protocol.hpp"
#include "sim/random_streams.hpp"
#include "sim/stem_frames.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval::experiments::place_recognition;

namespace {

/// By trying every confidence as threshold.
PlaceScore score_by_brute_force(const std::vector<Trial>& trials) {
  PlaceScore score;
  double with_match = 0.0, right_at_1 = 0.0;
  for (const Trial& trial : trials) {
    with_match += trial.has_match;
    right_at_1 += trial.is_right;
  }
  score.recall_at_1 = right_at_1 / with_match;
  for (const Trial& threshold : trials) {
    if (!threshold.has_answer) continue;
    double right = 0.0, wrong = 0.0;
    for (const Trial& trial : trials) {
      if (!trial.has_answer || trial.confidence < threshold.confidence) continue;
      (trial.is_right ? right : wrong) += 1.0;
    }
    const double precision = right / (right + wrong);
    const double recall = right / with_match;
    if (right > 0.0)
      score.max_f1 = std::max(score.max_f1, 2.0 * precision * recall / (precision + recall));
    if (wrong == 0.0) score.recall_zero_wrong = std::max(score.recall_zero_wrong, recall);
  }
  return score;
}

StemDrive laps_drive(std::uint64_t seed) {
  sim::ForestParameters parameters = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.side_m = 150.0;
  auto random = sim::random_stream(seed, sim::Stream::kForest);
  const sim::Forest forest = sim::make_forest(parameters, random);
  const auto way = sim::make_stem_way(sim::StemWay::kLaps, forest, 500.0, seed);
  return levelled("laps", sim::drive_stem_frames(forest, way, {}, seed));
}

const std::atomic<bool> kGoOn{false};

}  // namespace

TEST_CASE("Recall, F1 and recall at zero wrong are those of every threshold", "[places]") {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int run = 0; run < 50; ++run) {
    std::vector<Trial> trials(60);
    for (Trial& trial : trials) {
      trial.has_match = unit(random) < 0.6;
      trial.has_answer = unit(random) < 0.9;
      trial.is_right = trial.has_match && trial.has_answer && unit(random) < 0.8;
      // Few values, so that some are equal.
      trial.confidence = std::floor(10.0 * unit(random) + (trial.is_right ? 6.0 : 0.0));
      trial.is_accepted = trial.has_answer && trial.confidence > 12.0;
    }
    trials.front().has_match = true;
    const PlaceScore score = score_of(trials);
    const PlaceScore expected = score_by_brute_force(trials);
    CHECK(score.recall_at_1 == Approx(expected.recall_at_1));
    CHECK(score.max_f1 == Approx(expected.max_f1));
    CHECK(score.recall_zero_wrong == Approx(expected.recall_zero_wrong));
    CHECK(score.queries + score.queries_without_match == trials.size());
  }
}

TEST_CASE("Accepted answers beyond the radius are wrong, with and without a match", "[places]") {
  std::vector<Trial> trials(4);
  for (Trial& trial : trials) trial.has_answer = trial.is_accepted = true;
  trials[0].has_match = trials[0].is_right = true;
  trials[1].has_match = true;
  const PlaceScore score = score_of(trials);
  CHECK(score.wrong_accepted == 3);
  CHECK(score.wrong_accepted_no_match == 2);
  CHECK(score.recall_accepted == 0.5);
  CHECK(score_of({}).queries == 0);
}

TEST_CASE("A drive in laps finds its own places, and no frame of just now", "[places]") {
  const StemDrive drive = laps_drive(3);
  const Protocol protocol;
  const Trials result = within_drive(drive, protocol, {}, 1, kGoOn);
  REQUIRE(result.trials.size() == drive.stems.size());
  for (std::size_t k = 0; k < protocol.frames_earlier; ++k) {
    CHECK_FALSE(result.trials[k].has_match);
    CHECK_FALSE(result.trials[k].has_answer);
  }
  const PlaceScore score = score_of(result.trials);
  CHECK(score.queries > 50);
  CHECK(score.recall_at_1 > 0.9);
  CHECK(score.wrong_accepted == 0);

  Protocol later;
  later.seconds_earlier = 1e6;
  for (const Trial& trial : within_drive(drive, later, {}, 1, kGoOn).trials)
    CHECK_FALSE((trial.has_match || trial.has_answer));
}

TEST_CASE("A drive in another forest is not found; windows hold more stems", "[places]") {
  const StemDrive drive = laps_drive(4);
  const StemDrive other = laps_drive(5);
  const Trials result = between_drives(drive, other, {}, {}, 1, kGoOn);
  for (const Trial& trial : result.trials) CHECK_FALSE(trial.is_accepted);

  const StemDrive window = windowed(drive, 5, {});
  std::size_t single = 0, several = 0;
  for (std::size_t k = 0; k < drive.stems.size(); ++k) {
    single += drive.stems[k].size();
    several += window.stems[k].size();
  }
  CHECK(static_cast<double>(several) > 1.1 * static_cast<double>(single));
  CHECK(window.world_T_level.size() == drive.world_T_level.size());
}
