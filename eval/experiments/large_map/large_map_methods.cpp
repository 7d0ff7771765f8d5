#include "eval/experiments/large_map/large_map_methods.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

#include "common/constellation/map.hpp"
#include "eval/baselines/mapper/pose.hpp"

namespace understory::eval::experiments::large_map {
namespace {

class ConstellationFinder final : public PlaceFinder {
 public:
  explicit ConstellationFinder(std::span<const Eigen::Vector2d> landmarks_m) {
    for (std::size_t i = 0; i < landmarks_m.size(); ++i) map_.insert(i + 1, landmarks_m[i]);
  }

  std::optional<geometry::SE2> find(const model::Keyframe& keyframe) const override {
    std::vector<constellation::ObservedPoint> points;
    points.reserve(keyframe.landmarks.size());
    for (const model::KeyframeLandmark& landmark : keyframe.landmarks) {
      points.push_back({landmark.position_m, std::sqrt(0.5 * landmark.covariance_m2.trace())});
    }
    const constellation::Localisation found = map_.localise(points);
    if (!found.found()) return std::nullopt;
    return found.map_T_sensor * keyframe.centre_T_base();
  }
  double bytes_per_landmark() const override {
    return static_cast<double>(map_.bytes()) / static_cast<double>(map_.size());
  }

 private:
  constellation::ConstellationMap map_;
};

class BaselineFinder final : public PlaceFinder {
 public:
  explicit BaselineFinder(std::span<const Eigen::Vector2d> landmarks_m)
      : landmarks_m_(landmarks_m.begin(), landmarks_m.end()),
        hierarchy_(landmarks_m_, parameters_.descriptor_step) {}

  std::optional<geometry::SE2> find(const model::Keyframe& keyframe) const override {
    std::vector<Eigen::Vector2d> local;
    for (const model::KeyframeLandmark& landmark : keyframe.landmarks) {
      local.push_back(landmark.position_m);
    }
    const auto found = baselines::mapper::localise(local, landmarks_m_, hierarchy_, parameters_);
    if (!found.estimate) return std::nullopt;
    const Eigen::Vector3d pose = found.estimate->map_T_base.pose().coordinates();
    return geometry::SE2(pose.x(), pose.y(), pose.z()) * keyframe.centre_T_base();
  }

 private:
  baselines::mapper::Parameters parameters_;
  std::vector<Eigen::Vector2d> landmarks_m_;
  baselines::hierarchy::Hierarchy hierarchy_;
};

}  // namespace

std::unique_ptr<PlaceFinder> make_place_finder(std::string_view method,
                                               std::span<const Eigen::Vector2d> landmarks_m) {
  if (method == "smoothing") return std::make_unique<ConstellationFinder>(landmarks_m);
  if (method == "baseline") return std::make_unique<BaselineFinder>(landmarks_m);
  throw std::invalid_argument("no such method: " + std::string(method));
}

}  // namespace understory::eval::experiments::large_map
