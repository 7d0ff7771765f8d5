// The map's landmarks as a scene of entities, each of up to 16 landmarks.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "common/foxglove/scene.hpp"
#include "common/model/existence.hpp"
#include "common/model/slam_output.hpp"
#include "common/model/submap.hpp"

namespace understory::foxglove {

/// Follows the map like `model::HeldMap`, and returns the entities that changed since the last
/// update. Landmarks handed over to a submap are in its frame, so a correction changes one
/// transform and no entity. Positions and radii are rounded to millimetres.
///
/// Memory: about 150 bytes a landmark, of at most `most_landmarks`; further ones are left out and
/// counted. Each take() costs O(size of the message * log(map)), MAP O(map), an update O(changed).
class LandmarkScene {
 public:
  /// With a limit for the stored landmarks.
  explicit LandmarkScene(std::size_t most_landmarks) : most_(most_landmarks) {}

  /// Takes the whole map; a map cut to bounds is skipped.
  void take(const model::WholeMap& map);
  /// Takes a change; an older one is skipped.
  void take(const model::MapDelta& delta);
  /// Takes an update; one that starts a map ends the previous map.
  void take(const model::MapUpdate& update);
  /// Takes a submap handed over by the mapper.
  void take(const model::Submap& submap);
  /// Takes probabilities of known landmarks; others are skipped.
  void take(const model::Existence& existence);

  /// Whether update() would contain changes.
  bool has_changed() const { return was_cleared_ || !changed_.empty(); }
  /// A SceneUpdate with the entities that changed since the last call.
  std::string update(model::Utime utime);
  /// Like update() with the result discarded, at less cost.
  void skip_update();
  /// A SceneUpdate that deletes everything and contains all entities.
  std::string whole(model::Utime utime) const;
  /// Landmarks in the scene.
  std::size_t size() const { return submap_of_.size(); }
  /// Landmarks left out since the start of the map.
  std::uint64_t left_out() const { return left_out_; }

 private:
  /// One landmark, rounded for drawing.
  struct Shown {
    Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
    double radius_m = 0.0;
    model::LandmarkKind kind = model::LandmarkKind::kTrunk;
    double probability = std::numeric_limits<double>::quiet_NaN();
    bool is_in_use = true;
  };
  /// An entity: landmarks of one submap (0 = in the mapper's memory) with neighbouring ids.
  struct BlockId {
    std::uint64_t submap = 0;
    std::uint64_t number = 0;
    bool operator<(const BlockId& other) const {
      return std::tie(submap, number) < std::tie(other.submap, other.number);
    }
  };
  using Block = std::map<model::LandmarkId, Shown>;

  static BlockId block_of(model::LandmarkId id, std::uint64_t submap);
  static std::string name_of(const BlockId& id);
  void clear();
  void put(const model::MapLandmark& landmark, std::uint64_t submap);
  void drop(model::LandmarkId id);
  void append_entity(JsonText& out, model::Utime utime, const BlockId& id,
                     const Block& block) const;

  std::size_t most_;
  std::map<BlockId, Block> blocks_;  ///< None of them empty.
  std::unordered_map<model::LandmarkId, std::uint64_t> submap_of_;
  std::set<BlockId> changed_;  ///< Removed ones included.
  bool was_cleared_ = true;  ///< Cleared since the last update: the client's entities are invalid.
  std::uint64_t version_ = 0;
  std::uint64_t left_out_ = 0;
};

}  // namespace understory::foxglove
