// Numbers that serve again.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace understory::geoslam_mapper::smoothing {

/// Numbers of things that are gone, given out again to new ones, with undo to the checkpoint. Every
/// function but rollback() is O(1).
class FreeNumbers {
 public:
  /// A number that is free; none where all are in use.
  std::optional<std::uint32_t> take() {
    if (free_.empty()) return std::nullopt;
    const std::uint32_t number = free_.back();
    free_.pop_back();
    changes_.emplace_back(true, number);
    return number;
  }
  /// Its thing is gone.
  void give(std::uint32_t number) {
    free_.push_back(number);
    changes_.emplace_back(false, number);
  }
  /// Those that are free.
  const std::vector<std::uint32_t>& numbers() const { return free_; }
  /// How many are free.
  std::size_t size() const { return free_.size(); }

  /// The checkpoint is now.
  void checkpoint() { changes_.clear(); }
  /// Back to the checkpoint. O(changes).
  void rollback() {
    for (; !changes_.empty(); changes_.pop_back()) {
      if (changes_.back().first) {
        free_.push_back(changes_.back().second);
      } else {
        free_.pop_back();
      }
    }
  }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.free_);
  }

 private:
  std::vector<std::uint32_t> free_;
  std::vector<std::pair<bool, std::uint32_t>> changes_;  ///< Taken (or given), since then.
};

}  // namespace understory::geoslam_mapper::smoothing
