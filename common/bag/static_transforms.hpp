// Where frames lie on a vehicle, from /tf_static, and from what never moves in /tf.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/bag/messages.hpp"

namespace understory::bag {

/// A tree of frames that do not move against each other.
class StaticTransforms {
 public:
  /// A transform; a later one of the same child replaces it. One with a position that is no number
  /// is left out.
  void add(const Pose& parent_T_child);
  /// A transform that is sent again and again (/tf): it counts where it stays the same in all of
  /// the recording (1 mm, 0.1 mrad) and add() has none of its child.
  void watch(const Pose& parent_T_child);
  /// Takes the watched ones that did not move among the others; the number of those taken.
  std::size_t take_watched();
  /// Takes coordinates of `from` to `to`; none where no chain joins them.
  std::optional<Eigen::Isometry3d> find(const std::string& to, const std::string& from) const;
  /// Whether the tree names it.
  bool has(const std::string& frame) const;
  /// All frames.
  std::vector<std::string> frames() const;
  /// A line for each transform that was left out, and for each frame with two places (1 mm, 0.1
  /// mrad), of which the later one counts.
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
  /// Whether the transform can be used; a remark where it cannot.
  bool admits(const Pose& parent_T_child);

  std::map<std::string, Link> links_;  ///< By child.
  std::map<std::string, Watched> watched_;
  std::set<std::string> unusable_;               ///< Remarks.
  std::map<std::string, std::string> replaced_;  ///< Remarks by child, of its last change.
};

}  // namespace understory::bag
