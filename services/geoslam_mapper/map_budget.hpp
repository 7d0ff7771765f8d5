// When MAP is sent whole without being asked for.
#pragma once

#include <cstddef>

namespace understory::geoslam_mapper {

/// Holds the bytes of the MAPs that nobody asked for at a share of all bytes: what is sent on other
/// channels earns, a MAP spends. A MAP that is due may borrow where nothing is owed; so the share
/// is exceeded by one MAP at most. A pure function of what was sent, the same live, in replay and
/// after a restart.
class MapBudget {
 public:
  /// `share` of all bytes, 0 (nothing is earned) to below 1.
  explicit MapBudget(double share = 0.1) : earned_per_byte_(share / (1.0 - share)) {}

  /// Bytes that were sent on other channels.
  void earn(std::size_t bytes) { credit_bytes_ += earned_per_byte_ * static_cast<double>(bytes); }
  /// Whether a MAP of so many bytes stays within the share.
  bool affords(std::size_t bytes) const { return static_cast<double>(bytes) <= credit_bytes_; }
  /// Whether a MAP that is due may be sent before it is earned.
  bool may_borrow() const { return credit_bytes_ >= 0.0; }
  /// A MAP was sent unasked.
  void spend(std::size_t bytes) { credit_bytes_ -= static_cast<double>(bytes); }

  /// Members of a saved state; see common/state. The share is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.credit_bytes_);
  }

 private:
  double earned_per_byte_;
  double credit_bytes_ = 0.0;
};

}  // namespace understory::geoslam_mapper
