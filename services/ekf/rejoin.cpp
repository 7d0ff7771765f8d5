#include "services/ekf/rejoin.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "services/ekf/joint_compatibility.hpp"

namespace understory::ekf {
namespace {

/// Of more unsettled observations the nearest ones are searched: this bounds the cost of a scan.
constexpr std::size_t kMostUnsettled = 256;
/// Fewest agreeing pairings with wide gates.
constexpr std::size_t kFewRejoin = 3;

struct LostLandmark {
  std::uint32_t landmark = 0;
  double gate_m = 0.0;  ///< Search radius.
};

/// Lost landmarks in the scan's view.
struct LostLandmarks {
  std::vector<LostLandmark> landmarks;
  /// Largest variance of the vehicle's heading relative to one of them [rad^2].
  double rotation_variance = 0.0;
};

LostLandmarks lost_landmarks(const FilterState& state, const model::FieldOfView& field_of_view,
                             std::uint64_t scan_number, const RejoinRules& rules) {
  LostLandmarks lost;
  const auto& landmarks = state.landmarks();
  const auto pause = static_cast<std::uint64_t>(rules.parameters.rejoin_after_scans);
  const Eigen::Matrix2d back = rotation_of(state.heading).transpose();
  for (std::uint32_t i = 0; i < landmarks.size(); ++i) {
    if (landmarks[i].is_ground_mark() || landmarks[i].last_scan + pause >= scan_number) continue;

    const Eigen::Matrix2d spread = innovation_covariance(state, i, i);
    const double gate = std::sqrt(rules.gates.landmark * spread.trace());
    model::FieldOfView view = field_of_view;
    view.max_range_m += gate;
    const bool in_view = view.contains(back * (landmarks[i].position - state.position));
    if (!in_view || gate > rules.parameters.rejoin_max_gate_m) continue;
    lost.landmarks.push_back({i, gate});

    const Eigen::Vector2d across = geometry::perpendicular(landmarks[i].position - state.position);
    const double range2 = std::max(1.0, across.squaredNorm());
    lost.rotation_variance =
        std::max(lost.rotation_variance, across.dot(spread * across) / (range2 * range2));
  }
  return lost;
}

/// Observations without a landmark, ascending.
std::vector<std::uint32_t> unsettled_observations(const ScanUpdate& update) {
  std::vector<std::uint32_t> unsettled;
  for (std::uint32_t k = 0; k < update.observations.size(); ++k) {
    if (!update.is_settled[k]) unsettled.push_back(k);
  }
  if (unsettled.size() <= kMostUnsettled) return unsettled;

  const auto distance = [&](std::uint32_t k) {
    return std::pair(update.observations[k].position_m.squaredNorm(), k);
  };
  std::ranges::nth_element(unsettled, unsettled.begin() + kMostUnsettled, {}, distance);
  unsettled.resize(kMostUnsettled);
  std::ranges::sort(unsettled);
  return unsettled;
}

/// Unsettled observations and the lost landmarks that may match each, those with the fewest choices
/// first.
struct Choices {
  std::vector<Candidates> candidates;
  double widest_gate_m = 0.0;
};

Choices choices(const FilterState& state, const model::TrackedScan& scan, const ScanUpdate& update,
                const LostLandmarks& lost, const Gates& gates) {
  Choices choices;
  for (const std::uint32_t k : unsettled_observations(update)) {
    const model::LandmarkKind kind = update.detection(scan, k).kind;
    std::vector<std::pair<double, std::uint32_t>> near;
    for (const LostLandmark& one : lost.landmarks) {
      if (state.landmarks()[one.landmark].kind != kind) continue;
      const double distance = squared_distance(state, one.landmark, update.observations[k]);
      if (distance > gates.landmark) continue;
      near.emplace_back(distance, one.landmark);
      choices.widest_gate_m = std::max(choices.widest_gate_m, one.gate_m);
    }
    if (near.empty()) continue;
    std::sort(near.begin(), near.end());
    Candidates& added = choices.candidates.emplace_back();
    added.observation = k;
    for (const auto& [distance, i] : near) added.landmarks.push_back(i);
  }

  std::stable_sort(choices.candidates.begin(), choices.candidates.end(),
                   [](const Candidates& a, const Candidates& b) {
                     return a.landmarks.size() < b.landmarks.size();
                   });
  if (choices.candidates.size() > kMaxSearched) choices.candidates.resize(kMaxSearched);
  return choices;
}

/// Approximating an arc of uncertain angle by a straight line is an error, too: it is added as
/// noise.
std::vector<Observation> with_bend(std::vector<Observation> observations,
                                   double rotation_variance) {
  for (Observation& observation : observations) {
    const double bend = 0.5 * observation.position_m.norm() * rotation_variance;
    observation.covariance_m2 += bend * bend * Eigen::Matrix2d::Identity();
  }
  return observations;
}

}  // namespace

std::optional<RejoinProposal> find_rejoining(const FilterState& state,
                                             const model::TrackedScan& scan,
                                             const ScanUpdate& update, std::uint64_t scan_number,
                                             const RejoinRules& rules) {
  // Individual candidates of each observation.
  const LostLandmarks lost = lost_landmarks(state, scan.field_of_view, scan_number, rules);
  const Choices found = choices(state, scan, update, lost, rules.gates);
  if (found.candidates.empty()) return std::nullopt;

  // The largest jointly compatible set.
  RejoinProposal proposal;
  proposal.observations = with_bend(update.observations, lost.rotation_variance);
  CompatibleSet set = joint_compatibility(state, proposal.observations, found.candidates,
                                          {rules.gates.rejoin, rules.max_nodes});
  proposal.pairings = std::move(set.pairings);
  proposal.nodes = set.nodes;

  // With wide gates a few may agree by chance.
  const bool is_wide = found.widest_gate_m > 2.0 * rules.min_separation_m;
  const std::size_t least = std::max(kFewRejoin, (found.candidates.size() + 1) / 2);
  if (is_wide && proposal.pairings.size() < least) return std::nullopt;
  return proposal;
}

}  // namespace understory::ekf
