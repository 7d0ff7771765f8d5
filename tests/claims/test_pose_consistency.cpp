// SLAM_POSE states its own uncertainty: the normalised estimation error squared (NEES) is 3 on
// average where the stated covariance is right.
#include "eval/harness/chain_drive.hpp"
#include "eval/harness/summary.hpp"
#include "services/geoslam_mapper/adapter.hpp"
#include "services/keyframer/adapter.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval;

namespace {

/// SLAM_POSE of one drive among ideal landmarks.
harness::PoseConsistency consistency_of(std::uint64_t seed) {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.forest.side_m = 300.0;
  parameters.path.length_m = 60.0;
  const sim::Drive drive(parameters, seed);

  harness::ChainRun run;
  harness::SensorChain chain(
      {keyframer::keyframer_service(), geoslam_mapper::geoslam_mapper_service()}, {});
  harness::watch_chain(chain, run);
  for (std::size_t k = 0; k < drive.size(); ++k) {
    run.truth.push_back({drive.utime(k), drive.world_T_vehicle()[k]});
    chain.feed("LANDMARKS", wire::encode_message(drive.scan(k).scan));
  }
  REQUIRE(run.slam.size() > drive.size() / 2);
  return harness::pose_consistency(run.slam, run.truth);
}

}  // namespace

TEST_CASE("the covariance of SLAM_POSE is neither too small nor too large", "[claims]") {
  constexpr int kDrives = 20;
  double sum = 0.0;
  for (int seed = 1; seed <= kDrives; ++seed) sum += consistency_of(seed).mean_nees;
  const double mean_nees = sum / kDrives;

  CAPTURE(mean_nees);
  // The errors of one drive hang together: each drive counts as one sample of 3 degrees of freedom.
  const auto [low, high] = harness::chi2_band_95(3.0 * kDrives);
  CHECK(mean_nees > low / kDrives);
  CHECK(mean_nees < high / kDrives);
}
