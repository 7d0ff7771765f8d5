// The filter and landmarks whose track was lost.
#include <algorithm>
#include <cmath>
#include <utility>

#include "services/ekf/ekf.hpp"

namespace understory::ekf {
namespace {

/// Sightings that one search for joint compatibility takes.
constexpr std::size_t kMaxSearched = 24;
constexpr int kMaxRounds = 4;

}  // namespace

/// Tracks that the filter does not know may be landmarks whose track was lost. Each round makes the
/// pose surer, so that more fall into place.
void Ekf::rejoin_lost(const model::TrackedScan& scan) {
  for (int round = 0; round < kMaxRounds; ++round) {
    if (!rejoin_round(scan)) break;
  }
}

bool Ekf::rejoin_round(const model::TrackedScan& scan) {
  const RejoinSearch search = rejoin_candidates(scan);
  if (search.candidates.empty()) return false;
  // What a straight line makes of an uncertain turn is noise too.
  std::vector<Observation> loose = observations_;
  for (Observation& seen : loose) {
    const double bend = 0.5 * seen.position_m.norm() * search.rotation_variance;
    seen.covariance_m2 += bend * bend * Eigen::Matrix2d::Identity();
  }
  std::vector<Pairing> found =
      joint_compatibility(state_, loose, search.candidates,
                          {parameters_.gate.rejoin_probability, parameters_.gate.rejoin_max_nodes});
  // Where the gates are wide, a few agree by chance.
  const bool wide = search.widest_gate_m > 2.0 * parameters_.map.min_separation_m;
  const std::size_t least = std::max<std::size_t>(3, (search.candidates.size() + 1) / 2);
  if (wide && found.size() < least) return false;
  update_checked(found, loose);
  for (const Pairing& pairing : found) {
    const model::TrackId track = tracks_[pairing.observation];
    const auto at =
        std::lower_bound(aliases_.begin(), aliases_.end(), track,
                         [](const Alias& a, model::TrackId key) { return a.track < key; });
    aliases_.insert(at, {track, state_.landmarks()[pairing.landmark].id});
    see(scan, pairing);
    ++counters_.rejoined;
  }
  return !found.empty();
}

/// Landmarks that were not seen for a while though the scan could show them, and the unknown tracks
/// that may be them.
Ekf::RejoinSearch Ekf::rejoin_candidates(const model::TrackedScan& scan) const {
  struct Lost {
    std::uint32_t landmark;
    double gate_m;
  };
  std::vector<Lost> lost;
  RejoinSearch search;
  const auto& landmarks = state_.landmarks();
  const auto pause = static_cast<std::uint64_t>(parameters_.gate.rejoin_after_scans);
  const Eigen::Matrix2d back = rotation_of(state_.heading).transpose();
  for (std::uint32_t i = 0; i < landmarks.size(); ++i) {
    if (landmarks[i].is_ground_mark() || landmarks[i].last_scan + pause >= scan_count_) continue;
    const Eigen::Matrix2d spread = innovation_covariance(state_, i, i);
    const double gate = std::sqrt(landmark_gate_ * spread.trace());
    model::FieldOfView view = scan.field_of_view;
    view.max_range_m += gate;
    const bool in_view = view.contains(back * (landmarks[i].position - state_.position));
    if (!in_view || gate > parameters_.gate.rejoin_max_gate_m) continue;
    lost.push_back({i, gate});
    const Eigen::Vector2d across = geometry::perpendicular(landmarks[i].position - state_.position);
    const double range2 = std::max(1.0, across.squaredNorm());
    search.rotation_variance =
        std::max(search.rotation_variance, across.dot(spread * across) / (range2 * range2));
  }
  for (std::uint32_t k = 0; k < observations_.size(); ++k) {
    if (settled_[k]) continue;
    const model::LandmarkKind kind = scan.landmarks[source_[k]].observed.kind;
    std::vector<std::pair<double, std::uint32_t>> near;
    for (const Lost& one : lost) {
      if (landmarks[one.landmark].kind != kind) continue;
      const double distance = squared_distance(state_, one.landmark, observations_[k]);
      if (distance > landmark_gate_) continue;
      near.emplace_back(distance, one.landmark);
      search.widest_gate_m = std::max(search.widest_gate_m, one.gate_m);
    }
    if (near.empty()) continue;
    std::sort(near.begin(), near.end());
    Candidates& added = search.candidates.emplace_back();
    added.observation = k;
    for (const auto& [distance, i] : near) added.landmarks.push_back(i);
  }
  std::stable_sort(search.candidates.begin(), search.candidates.end(),
                   [](const Candidates& a, const Candidates& b) {
                     return a.landmarks.size() < b.landmarks.size();
                   });
  if (search.candidates.size() > kMaxSearched) search.candidates.resize(kMaxSearched);
  return search;
}

}  // namespace understory::ekf
