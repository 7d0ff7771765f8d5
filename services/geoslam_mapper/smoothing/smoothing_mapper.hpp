// Our mapper: gated association around a prediction, search where that fails, all keyframes and
// landmarks in one graph.
#pragma once

#include "common/factor_graph/plane/smoother.hpp"
#include "common/geometry/registration.hpp"
#include "common/model/level.hpp"
#include "common/model/odometry_buffer.hpp"
#include "services/geoslam_mapper/geoslam_mapper.hpp"
#include "services/geoslam_mapper/smoothing/filter_track.hpp"
#include "services/geoslam_mapper/smoothing/gyro_bias.hpp"
#include "services/geoslam_mapper/smoothing/landmark_store.hpp"
#include "services/geoslam_mapper/smoothing/place_grid.hpp"

namespace understory::geoslam_mapper::smoothing {

class SmoothingMapper final : public MapperMethod {
 public:
  explicit SmoothingMapper(const SmoothingMapperParameters& parameters);

  model::MapUpdate add(const model::Keyframe& keyframe) override;
  std::optional<geometry::SE2WithCovariance> locate(const model::LandmarkScan& scan) override;
  void add(const model::Odometry& odometry) override;
  void add(const model::EkfPose& pose) override {
    odometry_.set_filter_pose(pose);
    filter_.add(pose);
  }
  void add(const model::EkfLevel& level) override { level_.set(level); }
  void start_with(std::span<const model::MapLandmark> landmarks) override;
  std::vector<model::KeyframePose> trajectory() const override;
  std::vector<model::MapLandmark> landmarks() const override;
  std::optional<std::vector<model::MapLandmark>> take_changed_landmarks() override;
  std::string save() const override;
  void load(const std::string& state) override;

 private:
  /// A place in the graph: the centre of one keyframe, or of several that were folded together.
  struct Node {
    factor_graph::plane::PoseId centre{};
    std::map<model::LandmarkId, factor_graph::plane::ObservationId>
        observations;            ///< Each landmark's factor in the graph.
    bool is_stationary = false;  ///< The vehicle stood there all the while.
  };
  /// A keyframe's base, rigidly tied to a node (a leaf of the graph: nothing else measures it).
  struct Base {
    NodeIndex node = 0;
    std::uint64_t sequence = 0;
    model::Utime utime = 0;
    geometry::SE2WithCovariance centre_T_base;  ///< `centre` of the node.
    /// Mean of the keyframe's members: where it stood, three times as exactly as the base tells.
    geometry::SE2 centre_T_middle;
    bool is_origin = false;  ///< The gauge: known exactly.
  };
  /// Where a keyframe is, and which of its landmarks are which.
  struct Placement {
    geometry::SE2WithCovariance map_T_centre;
    std::vector<model::Association> associations;
    bool by_prediction = false;
  };
  /// The last accepted keyframe's last member: odometry goes on from here. Frame: the node's
  /// centre.
  struct LastMember {
    NodeIndex node = 0;
    model::Utime utime = 0;
    geometry::SE2WithCovariance centre_T_vehicle;
    std::optional<model::GyroRotation> turn;  ///< From the centre to here, as the gyro has it.
  };
  struct Prediction {
    geometry::SE2WithCovariance map_T_centre;
    bool from_odometry = false;
  };

  // smoothing_mapper.cpp: the story of one keyframe.
  std::string malformed(const model::Keyframe& keyframe) const;
  bool may_start(const model::Keyframe& keyframe, model::MapUpdate& update);
  void start_map(const model::Keyframe& keyframe, model::MapUpdate& update);
  void report(const model::Keyframe& keyframe, const Placement& placement,
              model::MapUpdate& update);
  void finish(const model::Keyframe& keyframe, model::MapUpdate& update);
  Eigen::Matrix3d shared_error(const geometry::SE2& map_T_vehicle) const;
  geometry::SE2WithCovariance base_pose(const Base& base) const;
  geometry::SE2 middle_pose(const Base& base) const;
  model::MapLandmark to_map_landmark(const StoredLandmark& landmark) const;

  // smoothing_mapper_place.cpp: where is it?
  std::optional<Prediction> predict(const model::Keyframe& keyframe) const;
  std::optional<Placement> track(const model::Keyframe& keyframe,
                                 const Prediction& prediction) const;
  std::optional<Placement> search(const model::Keyframe& keyframe, model::MapUpdate& update) const;
  Placement associate(const model::Keyframe& keyframe,
                      const geometry::SE2WithCovariance& guess) const;
  std::vector<model::LandmarkId> landmarks_in_view(const model::Keyframe& keyframe,
                                                   const geometry::SE2WithCovariance& guess) const;
  std::vector<double> exact_variances(std::span<const factor_graph::plane::PointId> points) const;
  std::vector<double> relative_variances(const std::vector<model::LandmarkId>& ids) const;
  std::size_t matchable(const model::Keyframe& keyframe, const Placement& placement) const;
  bool contradicts_filter(const model::Keyframe& keyframe, const Placement& placement) const;

  // smoothing_mapper_locate.cpp: where is a single scan, between keyframes?
  std::optional<geometry::SE2WithCovariance> step_from_last_scan(
      const model::LandmarkScan& scan) const;
  geometry::SE2WithCovariance in_map(const geometry::Registration& found) const;

  // smoothing_mapper_fuse.cpp: what does it add?
  bool fuse(const model::Keyframe& keyframe, const Placement& placement, model::MapUpdate& update);
  NodeIndex add_node(const geometry::SE2& map_T_centre, const model::Keyframe& keyframe);
  std::optional<NodeIndex> foldable(const model::Keyframe& keyframe,
                                    const Placement& placement) const;
  model::Keyframe in_frame_of(NodeIndex node, const model::Keyframe& keyframe,
                              const Placement& placement) const;
  double repetition(NodeIndex node, const model::KeyframeLandmark& seen,
                    model::LandmarkId id) const;
  void observe(NodeIndex node, const model::KeyframeLandmark& seen, model::LandmarkId id);
  void put_into_graph(StoredLandmark& landmark);
  factor_graph::plane::PointId add_point(const StoredLandmark& landmark);
  void add_base(const Base& base);
  bool solve(NodeIndex node, model::MapUpdate& update);
  void count_observations(const model::Keyframe& keyframe, NodeIndex node,
                          const model::MapUpdate& update);

  // smoothing_mapper_motion.cpp: what does odometry say?
  std::optional<geometry::SE2WithCovariance> motion_since_last(model::Utime utime) const;
  void add_motion(const model::Keyframe& keyframe, NodeIndex node);
  std::optional<model::GyroRotation> rotation_to_centre(const model::Keyframe& keyframe) const;
  LastMember last_of(const model::Keyframe& keyframe, const Base& base) const;

  // smoothing_mapper_discover.cpp: new landmarks, and two that are one.
  void discover(const model::Keyframe& keyframe, NodeIndex node, model::MapUpdate& update);
  Candidate* matching_candidate(const Eigen::Vector2d& position,
                                const model::KeyframeLandmark& seen);
  void promote(const Candidate& candidate, model::MapUpdate& update);
  bool believable(const Candidate& candidate) const;
  void forget_stale_candidates();
  void merge_doubles(model::MapUpdate& update);
  void take_over(model::LandmarkId old_id, model::LandmarkId new_id);
  void adopt_estimates();

  SmoothingMapperParameters parameters_;
  factor_graph::plane::Smoother smoother_;
  LandmarkStore store_;
  std::vector<model::LandmarkId> changed_;  ///< New or moved since they were asked for.
  std::vector<Candidate> candidates_;
  std::vector<Node> nodes_;
  std::vector<Base> bases_;
  /// Bases that stand apart from the others of their node, and where; each node's.
  std::vector<std::uint32_t> standings_;
  std::vector<std::vector<std::uint32_t>> standings_of_node_;
  PlaceGrid places_;
  /// Per point of the graph: its landmark; 0 where that was taken over by another.
  std::vector<model::LandmarkId> landmark_of_point_;
  model::OdometryBuffer odometry_;  ///< Without the bias, where that is a variable of the graph.
  FilterTrack filter_;
  model::LevelCorrection level_;
  bool map_was_given_ = false;
  std::uint32_t keyframes_ = 0;  ///< Accepted.
  std::optional<LastMember> last_member_;
  GyroBias gyro_;
  /// The last keyframe's base, accepted or not: where it is, or is thought to be.
  std::optional<geometry::SE2WithCovariance> map_T_last_base_;
  std::optional<model::Utime> last_utime_;
  /// Of where the first scan stood against what it saw, which the map shares: frame `map` [m^2].
  Eigen::Matrix2d start_covariance_m2_ = Eigen::Matrix2d::Zero();
  std::optional<model::Utime> first_offered_;  ///< Keyframe, while there is no map.
  /// The last scan that was located between keyframes.
  struct LocatedScan {
    model::Utime utime = 0;
    geometry::SE2 map_T_vehicle;
    geometry::SE2 step;                                    ///< From the scan before.
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Among the landmarks near by.
  };
  std::optional<LocatedScan> located_;
};

/// Mean of the members' poses.
geometry::SE2 middle_of(const model::Keyframe& keyframe);

std::unique_ptr<MapperMethod> make_smoothing_mapper(const SmoothingMapperParameters& parameters);

}  // namespace understory::geoslam_mapper::smoothing
