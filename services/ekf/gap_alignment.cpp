#include "services/ekf/gap_alignment.hpp"

#include <algorithm>
#include <cmath>

#include "common/constellation/map.hpp"
#include "common/geometry/alignment.hpp"

namespace understory::ekf {
namespace {

/// Tracks that must agree on one pose; fewer only if all do.
constexpr std::size_t kManyAgree = 4;
constexpr std::size_t kFewAgree = 3;
/// Least share of the known tracks that must agree: the others may belong to moved objects, or be
/// mismatched.
constexpr double kAgreeing = 0.6;
/// Two landmarks at a smaller distance give an inaccurate heading [m].
constexpr double kShortest_m = 2.0;
/// Of more tracks the nearest ones are used.
constexpr std::size_t kMostTracks = 40;
/// Uncertainty of a pose by two landmarks beside the observations' noise [m].
constexpr double kSlack_m = 0.1;
constexpr double kGateSigmas = 3.5;

double sigma_of(const Observation& observation) {
  return std::sqrt(0.5 * observation.covariance_m2.trace());
}

/// Pairings that fit a pose.
std::vector<Pairing> explained(const FilterState& state, const ScanUpdate& update,
                               std::span<const Pairing> known, const geometry::SE2& pose,
                               double slack_m) {
  std::vector<Pairing> agreeing;
  for (const Pairing& pairing : known) {
    const Observation& observation = update.observations[pairing.observation];
    const Eigen::Vector2d off =
        pose * observation.position_m - state.landmarks()[pairing.landmark].position;
    if (off.norm() <= kGateSigmas * sigma_of(observation) + slack_m) agreeing.push_back(pairing);
  }
  return agreeing;
}

geometry::SE2 pose_by(const FilterState& state, const ScanUpdate& update,
                      std::span<const Pairing> pairings) {
  geometry::RigidAlignment2 sums;
  for (const Pairing& pairing : pairings) {
    const Observation& observation = update.observations[pairing.observation];
    sums.add(state.landmarks()[pairing.landmark].position, observation.position_m,
             1.0 / observation.covariance_m2.trace());
  }
  return sums.a_T_b();
}

/// Each two known landmarks give a pose; the one with the most fitting pairings is used.
std::optional<GapAlignment> by_tracks(const FilterState& state, const ScanUpdate& update,
                                      std::vector<Pairing> known) {
  if (known.size() < kFewAgree) return std::nullopt;
  std::ranges::stable_sort(known, {}, [&update](const Pairing& pairing) {
    return update.observations[pairing.observation].position_m.squaredNorm();
  });
  if (known.size() > kMostTracks) known.resize(kMostTracks);

  std::vector<Pairing> best;
  for (std::size_t i = 0; i < known.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Pairing both[] = {known[i], known[j]};
      const double apart = (update.observations[known[i].observation].position_m -
                            update.observations[known[j].observation].position_m)
                               .norm();
      if (apart < kShortest_m) continue;
      const double slack = kSlack_m + 0.5 * kSlack_m * known.size() / kManyAgree;
      auto agreeing = explained(state, update, known, pose_by(state, update, both), slack);
      if (agreeing.size() > best.size()) best = std::move(agreeing);
    }
  }

  // Fits again with all of them.
  const geometry::SE2 pose = pose_by(state, update, best);
  best = explained(state, update, best, pose, kSlack_m);
  const bool is_enough =
      best.size() >= kManyAgree
          ? static_cast<double>(best.size()) >= kAgreeing * static_cast<double>(known.size())
          : best.size() >= kFewAgree && best.size() == known.size();
  if (!is_enough) return std::nullopt;
  return GapAlignment{pose_by(state, update, best), std::move(best)};
}

std::optional<GapAlignment> by_constellation(const FilterState& state, const ScanUpdate& update,
                                             double radius_m) {
  constellation::ConstellationMap map;
  for (std::uint32_t i = 0; i < state.landmarks().size(); ++i) {
    if (!state.landmarks()[i].is_ground_mark()) map.insert(i, state.landmarks()[i].position);
  }
  std::vector<constellation::ObservedPoint> points;
  points.reserve(update.observations.size());
  for (const Observation& observation : update.observations)
    points.push_back({observation.position_m, sigma_of(observation)});

  const constellation::Localisation found =
      map.localise(points, {}, constellation::Disc{state.position, radius_m});
  if (!found.found()) return std::nullopt;
  GapAlignment alignment{found.map_T_sensor, {}};
  for (const constellation::PointAssociation& pair : found.associations)
    alignment.pairings.push_back({pair.observed, static_cast<std::uint32_t>(pair.landmark_id)});
  return alignment;
}

}  // namespace

std::optional<GapAlignment> align_after_gap(const FilterState& state, const ScanUpdate& update,
                                            std::span<const Pairing> known, double radius_m) {
  if (auto found = by_tracks(state, update, {known.begin(), known.end()})) return found;
  return by_constellation(state, update, radius_m);
}

void move_vehicle(FilterState& state, const geometry::SE2& anchor_T_vehicle) {
  // The estimate.
  const Eigen::Vector2d position = state.position;
  const Eigen::Vector2d velocity = state.velocity;
  const double rotated = geometry::wrap_angle(anchor_T_vehicle.theta() - state.heading);
  state.heading = anchor_T_vehicle.theta();
  state.position = anchor_T_vehicle.translation();
  state.velocity = rotation_of(rotated) * state.velocity;
  state.first_position = state.position;
  state.first_velocity = state.velocity;

  // Errors of position and velocity contain that of the heading times a lever, which has changed.
  VehicleMatrix change = VehicleMatrix::Identity();
  change.block<2, 1>(kPosition, kHeading) = state.lever(position) - state.lever(state.position);
  change.block<2, 1>(kVelocity, kHeading) = state.lever(velocity) - state.lever(state.velocity);
  const int count = state.size() - kVehicle;
  const VehicleMatrix vehicle =
      change * state.covariance_block<kVehicle, kVehicle>(0, 0) * change.transpose();
  state.covariance().topLeftCorner<kVehicle, kVehicle>() = vehicle;
  auto shared = state.covariance().bottomLeftCorner(count, kVehicle);
  for (int i = 0; i < count; ++i) {
    const Eigen::Matrix<double, 1, kVehicle> row = shared.row(i);
    shared.row(i).noalias() = row * change.transpose();
  }
}

}  // namespace understory::ekf
