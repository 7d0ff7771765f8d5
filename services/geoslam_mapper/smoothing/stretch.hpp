// The factors of a stretch of the path, for storage elsewhere.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/model/landmarks.hpp"
#include "common/model/map.hpp"
#include "common/state/archive.hpp"
#include "services/geoslam_mapper/smoothing/pose_graph.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Number of a node, unique within a drive.
enum class StretchNumber : std::uint32_t {};
/// The number itself.
constexpr std::uint32_t index(StretchNumber number) { return static_cast<std::uint32_t>(number); }

/// Measurements of the nodes of a stretch before they were condensed: expand() rebuilds the graph
/// of the uncut drive from its stretches. 24 bytes for each observation, about 1 MB per km of
/// forest.
struct Stretch {
  /// A keyframe, tied to its node.
  struct Keyframe {
    std::uint64_t sequence = 0;
    model::Utime utime = 0;
    geometry::SE2 node_T_base;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.sequence, s.utime, s.node_T_base);
    }
  };
  /// A node.
  struct Pose {
    StretchNumber number{};
    std::uint32_t scans = 0;      ///< At the time of condensing.
    geometry::SE2 origin_T_node;  ///< As estimated when it was condensed.
    std::vector<Keyframe> keyframes;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.number, s.scans, s.origin_T_node, s.keyframes);
    }
  };
  /// A landmark, likewise at the time of condensing.
  struct Landmark {
    model::LandmarkId id = 0;
    Eigen::Vector2f origin_p_landmark = Eigen::Vector2f::Zero();  ///< [m]

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.id, s.origin_p_landmark);
    }
  };
  /// An observation. Single precision is 4 um at 40 m.
  struct Observation {
    std::uint16_t pose = 0;      ///< Index in `poses`.
    std::uint16_t landmark = 0;  ///< Index in `landmarks`.
    std::array<float, 2> position_m{};
    std::array<float, 3> information{};  ///< xx, xy, yy [1/m^2]

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.pose, s.landmark, s.position_m, s.information);
    }
  };
  /// A motion between two nodes, one of which may be of a later stretch.
  struct Motion {
    StretchNumber a{};
    StretchNumber b{};
    geometry::SE2 a_T_b;  ///< As measured.
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    double seconds =
        0.0;  ///< Duration over which the gyro's bias acts on the rotation; 0: without bias.
    double bias_rad_s = 0.0;  ///< Estimate at that time.

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.a, s.b, s.a_T_b, s.information, s.seconds, s.bias_rad_s);
    }
  };

  /// The condensed node, which is the origin; none if the nodes stayed: then the origin is the
  /// map's.
  std::optional<NodeIndex> node;
  std::vector<Pose> poses;
  std::vector<Landmark> landmarks;
  std::vector<Observation> observations;
  std::vector<Motion> motions;

  /// After condensing: converts positions from the frame `map` to the condensed node's frame.
  void turn_to(std::span<const Retirement> retired);

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.node, s.poses, s.landmarks, s.observations, s.motions);
  }
};

}  // namespace understory::geoslam_mapper::smoothing
