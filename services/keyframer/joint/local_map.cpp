#include "services/keyframer/joint/local_map.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/geometry/point_rows.hpp"

namespace understory::keyframer::joint {
namespace {

/// Largest weight of a track's mean [observations]: older ones fade, so that the drift of `local`
/// does not blur it.
constexpr double kMaxWeight = 24.0;
/// A track with fewer observations may be an outlier of its neighbour: it takes a detection only if
/// that is e^4 times more likely.
constexpr std::uint32_t kConfirmed = 4;
constexpr double kReluctance = 8.0;
/// Scans with both tracks in view that are needed for a merge. Two trunks with detection
/// probability 0.8 are never detected together in six scans once in 500 cases.
constexpr int kMergeViews = 6;
constexpr double kMaxMergeDistance2_m2 = 4.0;
constexpr std::size_t kMaxMergeMemory = 4096;
/// Most merges in one scan; others wait for the next one.
constexpr std::size_t kMostMerges = 64;
/// With more tracks than this within the noise around one, they cannot be resolved.
constexpr std::size_t kCrowd = 64;
constexpr double kBin_m = 1.0;
/// A track that was not detected again in this number of views was noise.
constexpr int kNoiseViews = 16;
/// Tracks are kept up to this multiple of the sensor's range.
constexpr double kKeepRangeFactor = 1.5;

void take(Track& track, const model::Detection& detection, const geometry::SE2& local_T_vehicle) {
  ++track.observations;
  track.detected_bits |= 1u;
  track.in_view_bits |= 1u;

  const double weight = std::min<double>(track.observations, kMaxWeight);
  const Eigen::Vector2d position =
      local_T_vehicle * Eigen::Vector2d(detection.position_m.head<2>());
  track.position_m += (position - track.position_m) / weight;
  track.detection_variance_m2 += (plane_variance(detection) - track.detection_variance_m2) / weight;
  track.radius_m += (detection.radius_m - track.radius_m) / weight;
}

/// The tracks around a position that may be within the noise of a track there.
class Neighbourhood {
 public:
  Neighbourhood(std::span<const Track> tracks, double gate_sigmas) {
    std::vector<Eigen::Vector2d> positions;
    double variance_m2 = 0.0;
    for (const Track& track : tracks) {
      positions.push_back(track.position_m);
      variance_m2 = std::max(variance_m2, track.detection_variance_m2);
    }
    rows_ = geometry::PointRows(positions, kBin_m);
    reach_m_ =
        std::sqrt(std::min(gate_sigmas * gate_sigmas * variance_m2, kMaxMergeDistance2_m2)) + 1e-9;
  }

  bool is_crowd(const Eigen::Vector2d& place) const {
    return rows_.count_around(place, reach_m_) > kCrowd;
  }
  /// Indices of the tracks, ascending.
  std::vector<std::size_t> around(const Eigen::Vector2d& place) const {
    std::vector<std::size_t> near;
    rows_.for_each_within(place, reach_m_, [&](std::uint32_t i, double) { near.push_back(i); });
    std::ranges::sort(near);
    return near;
  }

 private:
  geometry::PointRows rows_;
  double reach_m_ = 0.0;
};

}  // namespace

double plane_variance(const model::Detection& detection) {
  return 0.5 * detection.covariance_m2.topLeftCorner<2, 2>().trace();
}

void LocalMap::clear() {
  tracks_.clear();
  merged_.clear();
}

std::vector<geometry::UncertainPoint> LocalMap::reference_points() const {
  std::vector<geometry::UncertainPoint> points;
  points.reserve(tracks_.size());
  for (const Track& track : tracks_) {
    const double weight = std::min<double>(track.observations, kMaxWeight);
    points.push_back({track.position_m, track.detection_variance_m2 / weight,
                      track.observations < kConfirmed ? kReluctance : 0.0});
  }
  return points;
}

std::size_t LocalMap::matchable(const geometry::SE2& local_T_vehicle,
                                const model::FieldOfView& view) const {
  const geometry::SE2 vehicle_T_local = local_T_vehicle.inverse();
  const auto visible = std::count_if(tracks_.begin(), tracks_.end(), [&](const Track& track) {
    return track.observations >= 2 && view.contains(vehicle_T_local * track.position_m);
  });
  // After the first scan no track has two observations yet: then all are counted.
  return visible > 0 ? static_cast<std::size_t>(visible) : tracks_.size();
}

std::vector<TrackNumber> LocalMap::add(const model::LandmarkScan& scan,
                                       std::span<const geometry::PointPair> pairs,
                                       const geometry::SE2& local_T_vehicle) {
  std::vector<TrackNumber> track_of(scan.detections.size(), 0);
  age(scan.field_of_view, local_T_vehicle);

  // Matched detections update their tracks.
  for (const geometry::PointPair& pair : pairs) {
    Track& track = tracks_[pair.reference];
    take(track, scan.detections[pair.observed], local_T_vehicle);
    track_of[pair.observed] = track.id;
  }

  // The others begin new ones.
  for (std::size_t i = 0; i < scan.detections.size(); ++i) {
    if (track_of[i] != 0) continue;
    begin(scan.detections[i], local_T_vehicle);
    track_of[i] = tracks_.back().id;
  }

  // Removes doubles and bounds the map.
  merge_doubles();
  drop_distant(scan.field_of_view.max_range_m, local_T_vehicle.translation());
  drop_excess();
  return track_of;
}

void LocalMap::age(const model::FieldOfView& view, const geometry::SE2& local_T_vehicle) {
  const geometry::SE2 vehicle_T_local = local_T_vehicle.inverse();
  for (Track& track : tracks_) {
    const bool visible = view.contains(vehicle_T_local * track.position_m);
    track.detected_bits <<= 1;
    track.in_view_bits = (track.in_view_bits << 1) | (visible ? 1u : 0u);
  }
}

void LocalMap::begin(const model::Detection& detection, const geometry::SE2& local_T_vehicle) {
  Track track;
  track.id = next_id_++;
  track.position_m = local_T_vehicle * Eigen::Vector2d(detection.position_m.head<2>());
  track.detection_variance_m2 = plane_variance(detection);
  track.radius_m = detection.radius_m;
  track.kind = detection.kind;
  track.observations = 1;
  track.detected_bits = track.in_view_bits = 1;
  tracks_.push_back(track);
}

bool LocalMap::within_noise(const Track& a, const Track& b) const {
  const double variance = std::max(a.detection_variance_m2, b.detection_variance_m2);
  const double gate2 = gate_sigmas_ * gate_sigmas_ * variance;
  return (a.position_m - b.position_m).squaredNorm() <= std::min(gate2, kMaxMergeDistance2_m2);
}

std::vector<TrackNumber> LocalMap::doubtful() const {
  const Neighbourhood neighbourhood(tracks_, gate_sigmas_);
  std::vector<TrackNumber> result;
  for (std::size_t young = 0; young < tracks_.size(); ++young) {
    const Track& track = tracks_[young];
    const auto is_perhaps = [&](std::size_t old) {
      return old < young && within_noise(tracks_[old], track) &&
             (tracks_[old].detected_bits & track.detected_bits) == 0;
    };
    if (neighbourhood.is_crowd(track.position_m) ||
        std::ranges::any_of(neighbourhood.around(track.position_m), is_perhaps)) {
      result.push_back(track.id);
    }
  }
  return result;
}

/// Within the noise of each other and never detected together, over enough scans with both in view.
bool LocalMap::is_double(const Track& a, const Track& b) const {
  return within_noise(a, b) && (a.detected_bits & b.detected_bits) == 0 &&
         std::popcount(a.in_view_bits & b.in_view_bits) >= kMergeViews;
}

/// Merges two tracks that are doubles into the older one.
void LocalMap::merge_doubles() {
  const Neighbourhood neighbourhood(tracks_, gate_sigmas_);
  std::vector<std::size_t> moved;  // By a merge, perhaps out of their neighbourhood.
  std::vector<bool> is_gone(tracks_.size(), false);
  for (std::size_t young = 1; young < tracks_.size() && moved.size() < kMostMerges; ++young) {
    const Track& b = tracks_[young];
    if (b.observations < 2 || std::popcount(b.in_view_bits) < kMergeViews) continue;
    if (neighbourhood.is_crowd(b.position_m)) continue;

    std::vector<std::size_t> near = neighbourhood.around(b.position_m);
    near.insert(near.end(), moved.begin(), moved.end());
    std::ranges::sort(near);
    for (const std::size_t old : near) {
      if (old >= young || is_gone[old] || !is_double(tracks_[old], b)) continue;
      absorb(tracks_[old], b);
      is_gone[young] = true;
      moved.push_back(old);
      break;
    }
  }

  std::size_t index = 0;
  if (!moved.empty()) std::erase_if(tracks_, [&](const Track&) { return is_gone[index++]; });
  if (merged_.size() > kMaxMergeMemory) {
    merged_.erase(merged_.begin(), merged_.begin() + kMaxMergeMemory / 2);
  }
}

void LocalMap::absorb(Track& a, const Track& b) {
  const double na = std::min<double>(a.observations, kMaxWeight);
  const double nb = std::min<double>(b.observations, kMaxWeight);
  a.position_m = (na * a.position_m + nb * b.position_m) / (na + nb);
  a.observations += b.observations;
  a.detected_bits |= b.detected_bits;
  a.in_view_bits |= b.in_view_bits;
  merged_.emplace_back(b.id, a.id);
}

void LocalMap::drop_distant(double max_range_m, const Eigen::Vector2d& vehicle_m) {
  const double limit = kKeepRangeFactor * max_range_m;
  std::erase_if(tracks_, [&](const Track& track) {
    const bool distant = (track.position_m - vehicle_m).norm() > limit;
    const bool noise = track.observations < 2 && std::popcount(track.in_view_bits) > kNoiseViews;
    return distant || noise;
  });
}

void LocalMap::drop_excess() {
  if (tracks_.size() <= kMostTracks) return;
  std::size_t excess = tracks_.size() - kMostTracks;
  std::erase_if(tracks_, [&](const Track& track) {
    const bool goes = excess > 0 && (track.detected_bits & 1U) == 0;
    if (goes) --excess;
    return goes;
  });
}

std::vector<TrackNumber> LocalMap::resolved(std::span<const TrackNumber> ids) const {
  std::vector<std::pair<TrackNumber, TrackNumber>> by_old = merged_;
  std::ranges::sort(by_old);
  std::vector<TrackNumber> result(ids.begin(), ids.end());
  for (TrackNumber& id : result) {
    // A track is merged once, into an older one: each chain of merges continues from there.
    for (auto step = by_old.begin(); step != by_old.end();) {
      step = std::ranges::lower_bound(by_old, id, {}, [](const auto& one) { return one.first; });
      if (step == by_old.end() || step->first != id) break;
      id = step->second;
    }
  }
  return result;
}

const Track* LocalMap::find(TrackNumber id) const {
  const auto found =
      std::lower_bound(tracks_.begin(), tracks_.end(), id,
                       [](const Track& track, TrackNumber key) { return track.id < key; });
  return found != tracks_.end() && found->id == id ? &*found : nullptr;
}

}  // namespace understory::keyframer::joint
