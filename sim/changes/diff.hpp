// What differs between a scene and a changed copy of it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/changes/course.hpp"

namespace understory::sim::changes {

/// A thing that was moved.
struct Move {
  ThingId thing = kGroundThing;
  Eigen::Vector3d by_m = Eigen::Vector3d::Zero();  ///< Frame `world`.
};

/// The difference between two copies of a scene (thesis on existence, *Dynamics Recording*).
struct Diff {
  std::vector<ThingId> removed;    ///< Ascending.
  std::vector<Move> moved;         ///< Ascending by thing.
  std::vector<Thing> added;        ///< With ids that are new.
  std::vector<Thing> occluders;    ///< Added, too: to hide what stays.
  ThingId next_id = kGroundThing;  ///< Free in the changed copy.
};

/// How much is changed.
struct DiffParameters {
  double share = 0.2;        ///< Of the things that can change: removed or moved, in [0, 1].
  double moved_share = 0.4;  ///< Of the changed things that can be moved: moved.
  double move_m = 0.5;       ///< In the plan.
  double added_share = 1.0;  ///< New things per removed one.
  int occluders = 2;
  std::optional<ThingKind> only;  ///< The one kind that can change; none: all.
};

/// Draws a diff. Exactly round(share * changeable things) things are removed or moved; a thing for
/// which there is no room at the distance asked for is removed instead. New things and occluders
/// are as many as there is room for. The ids of what is new begin at `first_id`, or where that is 0
/// at scene.next_id: several copies of one scene want different ones.
Diff make_diff(const Course& course, const DiffParameters& parameters, std::uint64_t seed,
               ThingId first_id = 0);

/// A patch of the forest that was felled, with a lorry beside it.
struct ClearCutParameters {
  int felled = 50;            ///< Trees that are nearest to the middle of the patch.
  int hidden = 20;            ///< Trees behind the lorry, of those that stay.
  double from_path_m = 12.0;  ///< Of the middle of the patch.
};
/// Fells neighbours and parks the lorry between the path and other trees, of which it is placed to
/// hide as many as it can up to `hidden`. Throws std::runtime_error where there are not as many
/// trees or no room for a lorry.
Diff make_clear_cut(const Course& course, const ClearCutParameters& parameters, std::uint64_t seed,
                    ThingId first_id = 0);

/// The changed copy. What the diff names and is not there is passed over.
Scene changed(const Scene& scene, const Diff& diff);

/// What became of a thing.
enum class ThingState : std::uint8_t { kPresent, kGone, kMoved, kNew };
/// "present", "gone", "moved", "new".
std::string_view to_string(ThingState state);
/// The state of this name; none for another.
std::optional<ThingState> thing_state(std::string_view name);

/// A thing of either copy.
struct TrueThing {
  ThingId id = kGroundThing;
  ThingKind kind = ThingKind::kEquipment;
  ThingState state = ThingState::kPresent;
  Eigen::Vector3d by_m = Eigen::Vector3d::Zero();      ///< How far it was moved.
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();  ///< In the copy; where it is gone, before.
};
/// All things of both, in order of id.
std::vector<TrueThing> compare(const Scene& before, const Scene& after);

}  // namespace understory::sim::changes
