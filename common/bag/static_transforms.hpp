// Poses of frames on a vehicle, from /tf_static and from constant transforms of /tf.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/bag/messages.hpp"

namespace understory::bag {

/// A tree of frames that are fixed to each other.
class StaticTransforms {
 public:
  /// Adds a transform; it replaces an earlier one of the same child. A transform with a NaN
  /// position is left out.
  void add(const Pose& parent_T_child);
  /// Adds a repeated transform (/tf). It is used if it stays constant in the whole recording (1 mm,
  /// 0.1 mrad) and add() has none of its child.
  void watch(const Pose& parent_T_child);
  /// Adds the constant ones of watch() to the tree; returns their number.
  std::size_t take_watched();
  /// to_T_from; none where no chain connects the two.
  std::optional<Eigen::Isometry3d> find(const std::string& to, const std::string& from) const;
  /// Whether the tree contains the frame.
  bool has(const std::string& frame) const;
  /// All frames.
  std::vector<std::string> frames() const;
  /// A line for each transform that was left out, and for each frame with two poses (1 mm, 0.1
  /// mrad); the later one is used.
  std::vector<std::string> remarks() const;

 private:
  struct Link {
    std::string parent;
    Eigen::Isometry3d parent_T_child;
  };
  /// The frame's ancestors, itself first, each with the transform from the frame to it.
  std::vector<std::pair<std::string, Eigen::Isometry3d>> ancestors(const std::string& frame) const;

  struct Watched {
    Link first;
    bool has_moved = false;
  };
  static bool is_same(const Link& a, const Link& b);
  /// Whether the transform is usable; adds a remark if not.
  bool admits(const Pose& parent_T_child);

  std::map<std::string, Link> links_;  ///< By child.
  std::map<std::string, Watched> watched_;
  std::set<std::string> unusable_;               ///< Remarks.
  std::map<std::string, std::string> replaced_;  ///< Remarks by child, on its last change.
};

}  // namespace understory::bag
