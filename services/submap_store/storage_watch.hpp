// What HEALTH says of the store's file.
#pragma once

#include <array>
#include <optional>

#include "common/bus/condition.hpp"
#include "common/map_file/map_file_error.hpp"
#include "common/model/landmarks.hpp"

namespace understory::submap_store {

/// The reason that HEALTH and LOG have for a fault of a file.
wire::Reason reason_of(map_file::Fault fault);

/// One condition for each thing that can be wrong with a file. It holds from the first call that
/// fails so until a call succeeds; where the drive goes on in the next file, for a minute. It is no
/// part of a saved state: the file is looked at anew.
class StorageWatch {
 public:
  /// All is well.
  StorageWatch();

  /// A call failed.
  void failed(map_file::Fault fault);
  /// A file was passed over for its fault at this message time [us].
  void passed_over(map_file::Fault fault, model::Utime now);
  /// A call succeeded at this message time [us].
  void succeeded(model::Utime now);
  /// What to show.
  const std::array<bus::WatchedCondition, 6>& conditions() const { return conditions_; }

 private:
  std::array<bus::WatchedCondition, 6> conditions_;
  std::optional<wire::Reason> passed_over_;  ///< Of the file that was passed over last.
  model::Utime passed_over_at_ = 0;
};

}  // namespace understory::submap_store
