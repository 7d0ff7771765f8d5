// Our mapper: gated association around a prediction, search where that fails, all keyframes and
// landmarks in one graph.
#pragma once

#include "common/factor_graph/smoother.hpp"
#include "common/geometry/registration.hpp"
#include "common/model/level.hpp"
#include "common/model/odometry_buffer.hpp"
#include "services/geoslam_mapper/filter_track.hpp"
#include "services/geoslam_mapper/geoslam_mapper.hpp"
#include "services/geoslam_mapper/gyro_bias.hpp"
#include "services/geoslam_mapper/landmark_store.hpp"
#include "services/geoslam_mapper/place_grid.hpp"

namespace understory {

class SmoothingMapper final : public MapperMethod {
 public:
  explicit SmoothingMapper(const SmoothingMapperParameters& parameters);

  MapUpdate add(const Keyframe& keyframe) override;
  std::optional<SE2WithCovariance> locate(const LandmarkScan& scan) override;
  void add(const Odometry& odometry) override;
  void add(const EkfPose& pose) override {
    odometry_.know(pose);
    filter_.add(pose);
  }
  void add(const EkfLevel& level) override { level_.know(level); }
  void start_with(std::span<const MapLandmark> landmarks) override;
  std::vector<KeyframePose> trajectory() const override;
  std::vector<MapLandmark> landmarks() const override;
  std::optional<std::vector<MapLandmark>> take_changed_landmarks() override;
  std::string save() const override;
  void load(const std::string& state) override;

 private:
  /// A place in the graph: the centre of one keyframe, or of several that were folded together.
  struct Node {
    PoseId centre{};
    std::map<LandmarkId, ObservationId> observations;  ///< Each landmark's factor in the graph.
    bool stands = false;                               ///< The vehicle stood there all the while.
  };
  /// A keyframe's base, rigidly tied to a node (a leaf of the graph: nothing else measures it).
  struct Base {
    NodeIndex node = 0;
    std::uint64_t sequence = 0;
    Utime utime = 0;
    SE2WithCovariance centre_T_base;  ///< `centre` of the node.
    /// Mean of the keyframe's members: where it stood, three times as exactly as the base tells.
    SE2 centre_T_middle;
    bool is_origin = false;  ///< The gauge: known exactly.
  };
  /// Where a keyframe is, and which of its landmarks are which.
  struct Placement {
    SE2WithCovariance map_T_centre;
    std::vector<Association> associations;
    bool by_prediction = false;
  };
  /// The last accepted keyframe's last member: odometry goes on from here. Frame: the node's
  /// centre.
  struct LastMember {
    NodeIndex node = 0;
    Utime utime = 0;
    SE2WithCovariance centre_T_vehicle;
    std::optional<GyroTurn> turn;  ///< From the centre to here, as the gyro has it.
  };
  struct Prediction {
    SE2WithCovariance map_T_centre;
    bool from_odometry = false;
  };

  // smoothing_mapper.cpp: the story of one keyframe.
  std::string malformed(const Keyframe& keyframe) const;
  bool may_start(const Keyframe& keyframe, MapUpdate& update);
  void start_map(const Keyframe& keyframe, MapUpdate& update);
  void report(const Keyframe& keyframe, const Placement& placement, MapUpdate& update);
  void finish(const Keyframe& keyframe, MapUpdate& update);
  Eigen::Matrix3d shared_error(const SE2& map_T_vehicle) const;
  SE2WithCovariance base_pose(const Base& base) const;
  SE2 middle_pose(const Base& base) const;
  MapLandmark as_told(const StoredLandmark& landmark) const;

  // smoothing_mapper_place.cpp: where is it?
  std::optional<Prediction> predict(const Keyframe& keyframe) const;
  std::optional<Placement> track(const Keyframe& keyframe, const Prediction& prediction) const;
  std::optional<Placement> search(const Keyframe& keyframe, MapUpdate& update) const;
  Placement associate(const Keyframe& keyframe, const SE2WithCovariance& guess) const;
  std::vector<LandmarkId> landmarks_in_view(const Keyframe& keyframe,
                                            const SE2WithCovariance& guess) const;
  std::vector<double> exact_variances(std::span<const PointId> points) const;
  std::vector<double> relative_variances(const std::vector<LandmarkId>& ids) const;
  std::size_t matchable(const Keyframe& keyframe, const Placement& placement) const;
  bool contradicts_filter(const Keyframe& keyframe, const Placement& placement) const;

  // smoothing_mapper_locate.cpp: where is a single scan, between keyframes?
  std::optional<SE2WithCovariance> step_from_last_scan(const LandmarkScan& scan) const;
  SE2WithCovariance in_map(const Registration& found) const;

  // smoothing_mapper_fuse.cpp: what does it add?
  bool fuse(const Keyframe& keyframe, const Placement& placement, MapUpdate& update);
  NodeIndex add_node(const SE2& map_T_centre, const Keyframe& keyframe);
  std::optional<NodeIndex> foldable(const Keyframe& keyframe, const Placement& placement) const;
  Keyframe in_frame_of(NodeIndex node, const Keyframe& keyframe, const Placement& placement) const;
  double repetition(NodeIndex node, const KeyframeLandmark& seen, LandmarkId id) const;
  void observe(NodeIndex node, const KeyframeLandmark& seen, LandmarkId id);
  void put_into_graph(StoredLandmark& landmark);
  PointId add_point(const StoredLandmark& landmark);
  void add_base(const Base& base);
  bool solve(NodeIndex node, MapUpdate& update);
  void count_sightings(const Keyframe& keyframe, NodeIndex node, const MapUpdate& update);

  // smoothing_mapper_motion.cpp: what does odometry say?
  std::optional<SE2WithCovariance> motion_since_last(Utime utime) const;
  void add_motion(const Keyframe& keyframe, NodeIndex node);
  std::optional<GyroTurn> turn_to_centre(const Keyframe& keyframe) const;
  LastMember last_of(const Keyframe& keyframe, const Base& base) const;

  // smoothing_mapper_discover.cpp: new landmarks, and two that are one.
  void discover(const Keyframe& keyframe, NodeIndex node, MapUpdate& update);
  Candidate* matching_candidate(const Eigen::Vector2d& position, const KeyframeLandmark& seen);
  void promote(const Candidate& candidate, MapUpdate& update);
  bool believable(const Candidate& candidate) const;
  void forget_stale_candidates();
  void merge_doubles(MapUpdate& update);
  void take_over(LandmarkId old_id, LandmarkId new_id);
  void adopt_estimates();

  SmoothingMapperParameters parameters_;
  Smoother smoother_;
  LandmarkStore store_;
  std::vector<LandmarkId> changed_;  ///< New or moved since they were asked for.
  std::vector<Candidate> candidates_;
  std::vector<Node> nodes_;
  std::vector<Base> bases_;
  /// Bases that stand apart from the others of their node, and where; each node's.
  std::vector<std::uint32_t> standings_;
  std::vector<std::vector<std::uint32_t>> standings_of_node_;
  PlaceGrid places_;
  /// Per point of the graph: its landmark; 0 where that was taken over by another.
  std::vector<LandmarkId> landmark_of_point_;
  OdometryBuffer odometry_;  ///< Without the bias, where that is a variable of the graph.
  FilterTrack filter_;
  KnownLevel level_;
  bool map_was_given_ = false;
  std::uint32_t keyframes_ = 0;  ///< Accepted.
  std::optional<LastMember> last_member_;
  GyroBias gyro_;
  /// The last keyframe's base, accepted or not: where it is, or is thought to be.
  std::optional<SE2WithCovariance> map_T_last_base_;
  std::optional<Utime> last_utime_;
  /// Of where the first scan stood against what it saw, which the map shares: frame `map` [m^2].
  Eigen::Matrix2d start_covariance_m2_ = Eigen::Matrix2d::Zero();
  std::optional<Utime> first_offered_;  ///< Keyframe, while there is no map.
  /// The last scan that was located between keyframes.
  struct LocatedScan {
    Utime utime = 0;
    SE2 map_T_vehicle;
    SE2 step;                                              ///< From the scan before.
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Among the landmarks near by.
  };
  std::optional<LocatedScan> located_;
};

/// Mean of the members' poses.
SE2 middle_of(const Keyframe& keyframe);

std::unique_ptr<MapperMethod> make_smoothing_mapper(const SmoothingMapperParameters& parameters);

}  // namespace understory
