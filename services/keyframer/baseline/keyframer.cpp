#include "services/keyframer/baseline/keyframer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "services/keyframer/baseline/clusters.hpp"
#include "services/keyframer/baseline/keyframer_state.hpp"
#include "services/keyframer/baseline/observation.hpp"

namespace understory::keyframer::baseline {
namespace {

using hierarchy::baseline::Similarity;

/// Of a landmark, per axis [m^2]: the information in the thesis's graph is 100 I.
constexpr double kLandmarkVariance = 0.01;

AlignmentParameters alignment_parameters(const BaselineKeyframerParameters& parameters) {
  return {parameters.max_descriptor_distance, parameters.max_side_difference,
          parameters.min_triangle_match_ratio, parameters.min_associations,
          parameters.max_association_distance_m};
}

class BaselineKeyframer final : public KeyframerMethod {
 public:
  explicit BaselineKeyframer(const BaselineKeyframerParameters& parameters)
      : parameters_(parameters), alignment_(alignment_parameters(parameters)) {}

  std::optional<model::Keyframe> add(const model::LandmarkScan& scan) override;
  void add(const model::Odometry& /*odometry*/) override {}  // The method uses landmarks alone.
  const KeyframerCounters& counters() const override { return state_.counters; }
  std::string save() const override { return baseline::save(state_); }
  void load(const std::string& bytes) override {
    state_ = load_keyframer_state(bytes, parameters_.descriptor_step);
  }

 private:
  void link_to_members(Observation scan);
  void start_keyframe(Observation scan);
  void insert_member(Observation member);
  bool is_due(std::uint64_t number) const;
  void drop_stale(std::uint64_t number);
  model::Keyframe publish();
  std::vector<model::KeyframeLandmark> centroids() const;

  BaselineKeyframerParameters parameters_;
  AlignmentParameters alignment_;
  KeyframerState state_;
};

std::optional<model::Keyframe> BaselineKeyframer::add(const model::LandmarkScan& scan) {
  const std::uint64_t number = state_.counters.scans++;
  if (scan.detections.size() < 3) {
    ++state_.counters.scans_unmatched;
    state_.counters.last_reason = "fewer than three landmarks";
    return std::nullopt;
  }

  // Align the scan with the keyframe in progress, or begin one.
  Observation observation = make_observation(scan, number, parameters_.descriptor_step);
  if (state_.members.empty()) {
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
void BaselineKeyframer::drop_stale(std::uint64_t number) {
  const auto stale = static_cast<std::uint64_t>(parameters_.stale_after_observations);
  if (!state_.waiting.empty() && state_.waiting.front().number + stale <= number) {
    state_.waiting.erase(state_.waiting.begin());
    ++state_.counters.scans_unmatched;
  }
}

/// Newest member first; the first that matches is taken. Scans that waited follow, oldest first.
void BaselineKeyframer::link_to_members(Observation scan) {
  const auto& members = state_.members;
  for (auto member = members.rbegin(); member != members.rend(); ++member) {
    const auto target_T_scan = align(scan, *member, alignment_);
    if (!target_T_scan) {
      continue;
    }
    // Composed in the published order, the reverse of the right one; equal only where they commute.
    scan.base_T_vehicle = *target_T_scan * member->base_T_vehicle;

    auto& waiting = state_.waiting;
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
  state_.waiting.push_back(std::move(scan));
}

/// The older of the first two scans that match is the base. Only scans older than the base are
/// tried against the new one, newest first, as in the code.
void BaselineKeyframer::start_keyframe(Observation scan) {
  auto& waiting = state_.waiting;
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

void BaselineKeyframer::insert_member(Observation member) {
  const auto place = std::lower_bound(
      state_.members.begin(), state_.members.end(), member.number,
      [](const Observation& other, std::uint64_t number) { return other.number < number; });
  state_.members.insert(place, std::move(member));
}

bool BaselineKeyframer::is_due(std::uint64_t number) const {
  if (state_.members.empty()) {
    return false;
  }
  const auto full = static_cast<std::size_t>(parameters_.observations_per_keyframe);
  const auto stale = static_cast<std::uint64_t>(parameters_.stale_after_observations);
  return state_.members.size() >= full || state_.members.back().number + stale <= number;
}

model::Keyframe BaselineKeyframer::publish() {
  // The base comes first, the other members in order of time.
  const auto base = std::find_if(state_.members.begin(), state_.members.end(),
                                 [](const Observation& member) { return member.is_base; });
  std::rotate(state_.members.begin(), base, base + 1);

  model::Keyframe keyframe;
  const Observation& first = state_.members.front();
  keyframe.utime = first.utime;
  keyframe.sequence = state_.counters.keyframes++;
  keyframe.field_of_view = first.field_of_view;
  for (const Observation& member : state_.members) {
    keyframe.members.push_back(
        {member.utime, member.sequence, member.base_T_vehicle.pose(), Eigen::Matrix3d::Zero()});
  }

  keyframe.landmarks = centroids();
  state_.members.clear();
  return keyframe;
}

/// The means of the clusters of all members' landmarks, in the frame of the base.
std::vector<model::KeyframeLandmark> BaselineKeyframer::centroids() const {
  std::vector<Eigen::Vector2d> cloud;
  std::vector<std::pair<std::size_t, std::size_t>> origins;  // Member, detection.
  for (std::size_t m = 0; m < state_.members.size(); ++m) {
    const Observation& member = state_.members[m];
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
      landmark.radius_m += state_.members[m].radii_m[i];
      landmark.kind = state_.members[m].kinds[i];
    }
    landmark.position_m /= static_cast<double>(cluster.size());
    landmark.radius_m /= static_cast<double>(cluster.size());
    landmark.covariance_m2 = kLandmarkVariance * Eigen::Matrix2d::Identity();
    landmark.observation_count = static_cast<std::uint16_t>(cluster.size());
    landmarks.push_back(landmark);
  }
  return landmarks;
}

}  // namespace

std::unique_ptr<KeyframerMethod> make_baseline_keyframer(
    const BaselineKeyframerParameters& parameters) {
  return std::make_unique<BaselineKeyframer>(parameters);
}

}  // namespace understory::keyframer::baseline
