// HEALTH of the store's file.
#pragma once

#include <array>
#include <optional>

#include "common/bus/condition.hpp"
#include "common/map_file/map_file_error.hpp"
#include "common/model/landmarks.hpp"

namespace understory::submap_store {

/// Reason in HEALTH and LOG for a fault of a file.
wire::Reason reason_of(map_file::Fault fault);

/// One condition per kind of fault. It holds from the first failing call until a call succeeds; if
/// the drive continues in the next file, for a minute. Not saved: the file is checked again after a
/// restart.
class StorageWatch {
 public:
  /// No condition is raised.
  StorageWatch();

  /// A call failed.
  void failed(map_file::Fault fault);
  /// A file was skipped for its fault at this message time [us].
  void passed_over(map_file::Fault fault, model::Utime now);
  /// A call succeeded at this message time [us].
  void succeeded(model::Utime now);
  /// The conditions for HEALTH.
  const std::array<bus::WatchedCondition, 6>& conditions() const { return conditions_; }

 private:
  std::array<bus::WatchedCondition, 6> conditions_;
  std::optional<wire::Reason> passed_over_;  ///< Of the last skipped file.
  model::Utime passed_over_at_ = 0;
};

}  // namespace understory::submap_store
