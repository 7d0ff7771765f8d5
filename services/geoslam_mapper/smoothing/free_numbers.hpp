// Free list of numbers.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace understory::geoslam_mapper::smoothing {

/// Numbers of removed objects for reuse, with undo to the checkpoint. Every function but rollback()
/// is O(1).
class FreeNumbers {
 public:
  /// Takes a free number; none if there is none.
  std::optional<std::uint32_t> take() {
    if (free_.empty()) return std::nullopt;
    const std::uint32_t number = free_.back();
    free_.pop_back();
    changes_.emplace_back(true, number);
    return number;
  }
  /// Adds the number of a removed object.
  void give(std::uint32_t number) {
    free_.push_back(number);
    changes_.emplace_back(false, number);
  }
  /// The free numbers.
  const std::vector<std::uint32_t>& numbers() const { return free_; }
  /// Count of free numbers.
  std::size_t size() const { return free_.size(); }

  /// Sets the checkpoint.
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
  std::vector<std::pair<bool, std::uint32_t>>
      changes_;  ///< Taken (or given), since the checkpoint.
};

}  // namespace understory::geoslam_mapper::smoothing
