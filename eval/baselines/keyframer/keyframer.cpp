#include "eval/baselines/keyframer/keyframer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "eval/baselines/keyframer/clusters.hpp"
#include "eval/baselines/keyframer/observation.hpp"

namespace understory::eval::baselines::keyframer {
namespace {

using hierarchy::Similarity;

/// Of a landmark, per axis [m^2]: the information in the thesis's graph is 100 I.
constexpr double kLandmarkVariance = 0.01;

AlignmentParameters alignment_parameters(const Parameters& parameters) {
  return {parameters.max_descriptor_distance, parameters.max_side_difference,
          parameters.min_triangle_match_ratio, parameters.min_associations,
          parameters.max_association_distance_m};
}

}  // namespace

Keyframer::Keyframer(const Parameters& parameters)
    : parameters_(parameters), alignment_(alignment_parameters(parameters)) {}

std::optional<model::Keyframe> Keyframer::add(const model::LandmarkScan& scan) {
  const std::uint64_t number = scans_++;
  if (scan.detections.size() < 3) {
    ++scans_unmatched_;
    return std::nullopt;
  }

  // Align the scan with the keyframe in progress, or begin one.
  Observation observation = make_observation(scan, number, parameters_.descriptor_step);
  if (members_.empty()) {
    start_keyframe(std::move(observation));
  } else {
    link_to_members(std::move(observation));
  }

  // Give the keyframe out when it is full or no scan has joined it for a while.
  std::optional<model::Keyframe> keyframe;
  if (is_due(number)) {
    keyframe = publish();
  }
  drop_stale(number);
  return keyframe;
}

/// One stale scan per step, after the keyframe, as in the published code (the thesis drops it
/// before).
void Keyframer::drop_stale(std::uint64_t number) {
  const auto stale = static_cast<std::uint64_t>(parameters_.stale_after_observations);
  if (!waiting_.empty() && waiting_.front().number + stale <= number) {
    waiting_.erase(waiting_.begin());
    ++scans_unmatched_;
  }
}

/// Newest member first; the first that matches is taken. Scans that waited follow, oldest first.
void Keyframer::link_to_members(Observation scan) {
  for (auto member = members_.rbegin(); member != members_.rend(); ++member) {
    const auto target_T_scan = align(scan, *member, alignment_);
    if (!target_T_scan) {
      continue;
    }
    // Composed in the published order, the reverse of the right one; equal only where they commute.
    scan.base_T_vehicle = *target_T_scan * member->base_T_vehicle;

    auto& waiting = waiting_;
    for (auto other = waiting.begin(); other != waiting.end();) {
      const auto scan_T_other = align(*other, scan, alignment_);
      if (!scan_T_other) {
        ++other;
        continue;
      }
      other->base_T_vehicle = *scan_T_other * scan.base_T_vehicle;
      insert_member(std::move(*other));
      other = waiting.erase(other);
    }

    insert_member(std::move(scan));
    return;
  }
  waiting_.push_back(std::move(scan));
}

/// The older of the first two scans that match is the base. Only scans older than the base are
/// tried against the new one, newest first, as in the code.
void Keyframer::start_keyframe(Observation scan) {
  auto& waiting = waiting_;
  for (std::size_t i = waiting.size(); i-- > 0;) {
    const auto base_T_scan = align(scan, waiting[i], alignment_);
    if (!base_T_scan) {
      continue;
    }

    // The pair that matches.
    waiting[i].base_T_vehicle = Similarity{};
    waiting[i].is_base = true;
    scan.base_T_vehicle = *base_T_scan;
    insert_member(std::move(waiting[i]));
    waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(i));

    // Older scans that match the new one.
    for (std::size_t j = i; j-- > 0;) {
      if (const auto scan_T_other = align(waiting[j], scan, alignment_)) {
        waiting[j].base_T_vehicle = *scan_T_other * scan.base_T_vehicle;
        insert_member(std::move(waiting[j]));
        waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(j));
      }
    }
    insert_member(std::move(scan));
    return;
  }
  waiting.push_back(std::move(scan));
}

void Keyframer::insert_member(Observation member) {
  const auto place = std::lower_bound(
      members_.begin(), members_.end(), member.number,
      [](const Observation& other, std::uint64_t number) { return other.number < number; });
  members_.insert(place, std::move(member));
}

bool Keyframer::is_due(std::uint64_t number) const {
  if (members_.empty()) {
    return false;
  }
  const auto full = static_cast<std::size_t>(parameters_.observations_per_keyframe);
  const auto stale = static_cast<std::uint64_t>(parameters_.stale_after_observations);
  return members_.size() >= full || members_.back().number + stale <= number;
}

model::Keyframe Keyframer::publish() {
  // The base comes first, the other members in order of time.
  const auto base = std::find_if(members_.begin(), members_.end(),
                                 [](const Observation& member) { return member.is_base; });
  std::rotate(members_.begin(), base, base + 1);

  model::Keyframe keyframe;
  const Observation& first = members_.front();
  keyframe.utime = first.utime;
  keyframe.sequence = keyframes_++;
  keyframe.field_of_view = first.field_of_view;
  for (const Observation& member : members_) {
    keyframe.members.push_back(
        {member.utime, member.sequence, member.base_T_vehicle.pose(), Eigen::Matrix3d::Zero()});
  }

  keyframe.landmarks = centroids();
  members_.clear();
  return keyframe;
}

/// The means of the clusters of all members' landmarks, in the frame of the base.
std::vector<model::KeyframeLandmark> Keyframer::centroids() const {
  std::vector<Eigen::Vector2d> cloud;
  std::vector<std::pair<std::size_t, std::size_t>> origins;  // Member, detection.
  for (std::size_t m = 0; m < members_.size(); ++m) {
    const Observation& member = members_[m];
    for (std::size_t i = 0; i < member.points.size(); ++i) {
      cloud.push_back(member.base_T_vehicle * member.points[i]);
      origins.emplace_back(m, i);
    }
  }

  std::vector<model::KeyframeLandmark> landmarks;
  const auto largest = static_cast<std::size_t>(parameters_.observations_per_keyframe);
  for (const auto& cluster : single_linkage(cloud, parameters_.cluster_tolerance_m, 2, largest)) {
    model::KeyframeLandmark landmark;
    for (const std::uint32_t point : cluster) {
      const auto [m, i] = origins[point];
      landmark.position_m += cloud[point];
      landmark.radius_m += members_[m].radii_m[i];
      landmark.kind = members_[m].kinds[i];
    }
    landmark.position_m /= static_cast<double>(cluster.size());
    landmark.radius_m /= static_cast<double>(cluster.size());
    landmark.covariance_m2 = kLandmarkVariance * Eigen::Matrix2d::Identity();
    landmark.observation_count = static_cast<std::uint16_t>(cluster.size());
    landmarks.push_back(landmark);
  }
  return landmarks;
}

}  // namespace understory::eval::baselines::keyframer
