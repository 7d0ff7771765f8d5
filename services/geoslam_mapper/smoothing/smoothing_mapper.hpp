// The project's mapper: gated association around a prediction, search where that fails, all
// keyframes and landmarks in one graph.
#pragma once

#include "services/geoslam_mapper/mapper_method.hpp"
#include "services/geoslam_mapper/parameters.hpp"
#include "services/geoslam_mapper/smoothing/common_error.hpp"
#include "services/geoslam_mapper/smoothing/discovery.hpp"
#include "services/geoslam_mapper/smoothing/fusion.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/known_ground.hpp"
#include "services/geoslam_mapper/smoothing/motion.hpp"
#include "services/geoslam_mapper/smoothing/place_recogniser.hpp"
#include "services/geoslam_mapper/smoothing/scan_localiser.hpp"

namespace understory::geoslam_mapper::smoothing {

/// One keyframe's story, from arrival to answer; the work is done by the parts. See MapperMethod
/// for the functions.
class SmoothingMapper final : public MapperMethod {
 public:
  /// An empty map.
  explicit SmoothingMapper(const SmoothingMapperParameters& parameters);

  model::MapUpdate add(const model::Keyframe& keyframe) override;
  std::optional<geometry::SE2WithCovariance> locate(const model::LandmarkScan& scan) override;
  void add(const model::Odometry& odometry) override { motion_.add(odometry); }
  void add(const model::EkfPose& pose) override { motion_.add(pose); }
  void add(const model::EkfLevel& level) override { scan_localiser_.set(level); }
  void start_with(std::span<const model::MapLandmark> landmarks) override;

  std::vector<model::KeyframePose> trajectory() const override;
  std::vector<model::MapLandmark> landmarks() const override;
  std::optional<std::vector<model::MapLandmark>> take_changed_landmarks() override;

  std::string save() const override;
  void load(const std::string& state) override;

  /// Members of a saved state; see common/state. Parameters are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.map_, self.motion_, self.discovery_, self.known_ground_, self.scan_localiser_,
      self.common_error_, self.last_utime_, self.first_offered_);
  }

 private:
  std::string malformed(const model::Keyframe& keyframe) const;
  std::string why_not_start(const model::Keyframe& keyframe);
  void start_map(const model::Keyframe& keyframe, model::MapUpdate& update);
  std::optional<Placement> place(const model::Keyframe& keyframe,
                                 const std::optional<Prediction>& prediction,
                                 model::MapUpdate& update);
  void keep_pose(const model::Keyframe& keyframe, const Placement& placement);
  void extend(const FusedKeyframe& fused, model::MapUpdate& update);
  void report(const model::Keyframe& keyframe, model::MapUpdate& update);

  SmoothingMapperParameters parameters_;
  PlaceRecogniser place_recogniser_;
  GlobalMap map_;
  Motion motion_;
  Discovery discovery_;
  KnownGround known_ground_;
  ScanLocaliser scan_localiser_;
  CommonError common_error_;
  std::optional<model::Utime> last_utime_;     ///< Of the last well-formed keyframe.
  std::optional<model::Utime> first_offered_;  ///< Keyframe that might have started the map.
};

/// A SmoothingMapper with an empty map.
std::unique_ptr<MapperMethod> make_smoothing_mapper(const SmoothingMapperParameters& parameters);

}  // namespace understory::geoslam_mapper::smoothing
