// Budget for sending the whole MAP without a request.
#pragma once

#include <cstddef>

namespace understory::geoslam_mapper {

/// Limits the bytes of MAPs without a request to a share of all bytes: bytes on other channels earn
/// credit, a MAP spends it. A MAP that is due may borrow if there is no debt, so the excess over
/// the share is one MAP at most. A pure function of the bytes sent: the same live, in replay and
/// after a restart.
class MapBudget {
 public:
  /// `share` of all bytes, 0 (nothing is earned) to below 1.
  explicit MapBudget(double share = 0.1) : earned_per_byte_(share / (1.0 - share)) {}

  /// Whether a MAP of this size stays within the share.
  void earn(std::size_t bytes) { credit_bytes_ += earned_per_byte_ * static_cast<double>(bytes); }
  /// Whether a MAP of so many bytes stays within the share.
  bool affords(std::size_t bytes) const { return static_cast<double>(bytes) <= credit_bytes_; }
  /// Whether a MAP that is due may be sent on credit.
  bool may_borrow() const { return credit_bytes_ >= 0.0; }
  /// A MAP was sent without a request.
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
