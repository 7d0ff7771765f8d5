// The landmarks of a map for the page, with the time of each landmark's last change.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/model/existence.hpp"
#include "common/model/map.hpp"

namespace understory::viewer {

/// Counter of a scene's changes; each change has its own number.
using Change = std::uint64_t;
/// Index of a landmark in the page's arrays.
using Slot = std::uint32_t;

/// One landmark, with 4-byte numbers as drawn by the page.
struct SceneLandmark {
  /// Bits of `flags`.
  enum : std::uint8_t { kThere = 1, kCorner = 2, kOutOfUse = 4, kGiven = 8 };

  model::LandmarkId id = 0;
  float x_m = 0.0F;  ///< Frame map.
  float y_m = 0.0F;
  float covariance_xx_m2 = 0.0F;
  float covariance_xy_m2 = 0.0F;
  float covariance_yy_m2 = 0.0F;
  float radius_m = 0.0F;     ///< 0 = unknown.
  float probability = 0.0F;  ///< That it exists; NaN = unknown.
  std::uint32_t seen = 0;    ///< Scans.
  std::uint8_t flags = 0;    ///< Without kThere the slot is empty.
};

/// Position of a reader in a LandmarkTable.
struct LandmarkCursor {
  Change change = 0;  ///< Of the last landmark that it read.
  Slot slot = 0;      ///< Slot of that landmark.
  bool operator==(const LandmarkCursor&) const = default;
};

/// Slots are assigned in order and reused; a change costs O(1), reading costs the number of
/// changes. About 110 bytes per landmark.
class LandmarkTable {
 public:
  /// `changes` is the scene's counter and must outlive it.
  explicit LandmarkTable(Change& changes) : changes_(&changes) {}

  /// Adds or updates a landmark; its existence stays.
  void set(const model::MapLandmark& landmark, bool is_given = false);
  /// Sets whether it exists; a landmark that is not in the table is ignored.
  void set_existence(const model::LandmarkExistence& existence);
  /// Removes it and frees its slot.
  void remove(model::LandmarkId id);
  /// Removes all: slots begin anew.
  void clear();

  /// The landmark with this id; null if it is not in the table.
  const SceneLandmark* find(model::LandmarkId id) const;
  /// Its slot.
  std::optional<Slot> slot_of(model::LandmarkId id) const;
  /// All assigned slots; those without kThere are empty.
  std::span<const SceneLandmark> slots() const { return landmarks_; }
  /// Number of landmarks.
  std::size_t size() const { return slot_of_.size(); }
  /// Number of landmarks out of use.
  std::size_t unused() const { return unused_; }

  /// The slots that changed since `cursor`, oldest change first, at most `most`; moves the cursor.
  std::vector<Slot> changed_since(LandmarkCursor& cursor, std::size_t most) const;
  /// Whether there are any.
  bool has_changed_since(const LandmarkCursor& cursor) const {
    return !order_.empty() && last_ != kNone && order_[last_].change > cursor.change;
  }

 private:
  static constexpr Slot kNone = ~Slot{0};
  /// A list in the order of the latest change.
  struct Order {
    Change change = 0;
    Slot before = kNone;
    Slot after = kNone;
  };
  Slot new_slot();
  void touch(Slot slot);
  void unlink(Slot slot);
  Slot first_after(const LandmarkCursor& cursor) const;

  Change* changes_;
  std::vector<SceneLandmark> landmarks_;
  std::vector<Order> order_;
  std::vector<Slot> free_;
  std::unordered_map<model::LandmarkId, Slot> slot_of_;
  Slot first_ = kNone;
  Slot last_ = kNone;
  std::size_t unused_ = 0;
};

}  // namespace understory::viewer
