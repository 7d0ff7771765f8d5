#include "common/foxglove/topics.hpp"

#include <array>
#include <map>

#include "common/foxglove/numbers.hpp"
#include "common/foxglove/schemas.hpp"

namespace understory::foxglove {
namespace {

constexpr std::array<Topic, kTopics> kTable{{
    {TopicId::kTransforms, "/tf", "foxglove.FrameTransforms", Delivery::kLatest, true},
    {TopicId::kSubmapTransforms, "/tf/submaps", "foxglove.FrameTransforms", Delivery::kLatest,
     true},
    {TopicId::kPose, "/pose", "foxglove.PoseInFrame", Delivery::kLatest, true},
    {TopicId::kPath, "/pose/path", "foxglove.PosesInFrame", Delivery::kLatest, true},
    {TopicId::kKeyframes, "/map/keyframes", "foxglove.PosesInFrame", Delivery::kLatest, true},
    {TopicId::kLandmarks, "/map/landmarks", "foxglove.SceneUpdate", Delivery::kIncrement, true},
    {TopicId::kDetections, "/detections", "foxglove.SceneUpdate", Delivery::kLatest, false},
    {TopicId::kScan, "/scan", "foxglove.LaserScan", Delivery::kLatest, false},
    {TopicId::kSweep, "/sweep", "foxglove.PointCloud", Delivery::kLatest, false},
    {TopicId::kFilterPose, "/filter/pose", "foxglove.PoseInFrame", Delivery::kLatest, false},
    {TopicId::kDeadReckoning, "/odom/pose", "foxglove.PoseInFrame", Delivery::kLatest, false},
    {TopicId::kReference, "/reference/pose", "foxglove.PoseInFrame", Delivery::kLatest, false},
    {TopicId::kTruth, "/truth/pose", "foxglove.PoseInFrame", Delivery::kLatest, false},
    {TopicId::kTruthLandmarks, "/truth/landmarks", "foxglove.SceneUpdate", Delivery::kLatest, true},
    {TopicId::kFix, "/gnss", "foxglove.LocationFix", Delivery::kLatest, false},
    {TopicId::kLocalFix, "/gnss/local", "foxglove.PoseInFrame", Delivery::kLatest, false},
    {TopicId::kLog, "/log", "foxglove.Log", Delivery::kEach, false},
    {TopicId::kPoseNumbers, "/numbers/pose", "understory.Pose", Delivery::kEach, false},
    {TopicId::kUpdateNumbers, "/numbers/update", "understory.Update", Delivery::kEach, false},
    {TopicId::kFilterNumbers, "/numbers/filter", "understory.Filter", Delivery::kEach, false},
    {TopicId::kExistenceNumbers, "/numbers/existence", "understory.Existence", Delivery::kEach,
     false},
    {TopicId::kHealthNumbers, "/numbers/health", "understory.Health", Delivery::kEach, false},
    {TopicId::kLoopNumbers, "/numbers/loops", "understory.Loop", Delivery::kEach, false},
    {TopicId::kImuNumbers, "/numbers/imu", "understory.Imu", Delivery::kEach, false},
}};

constexpr bool is_in_order() {
  for (std::size_t i = 0; i < kTopics; ++i) {
    if (static_cast<std::size_t>(kTable[i].id) != i) return false;
  }
  return true;
}
static_assert(is_in_order());

std::array<std::string, kTopics> make_schemas() {
  std::map<std::string_view, std::string> by_name = well_known_schemas();
  by_name.merge(number_schemas());
  std::array<std::string, kTopics> result;
  for (std::size_t i = 0; i < kTopics; ++i) result[i] = by_name.at(kTable[i].schema_name);
  return result;
}

}  // namespace

std::span<const Topic> topics() { return kTable; }

const Topic& topic(TopicId id) { return kTable[static_cast<std::size_t>(id)]; }

const std::string& schema_of(TopicId id) {
  static const std::array<std::string, kTopics> schemas = make_schemas();
  return schemas[static_cast<std::size_t>(id)];
}

}  // namespace understory::foxglove
