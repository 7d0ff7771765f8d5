// What can be wrong with a map file.
#pragma once

#include <stdexcept>
#include <string>

namespace understory::map_file {

/// Why a map file was not opened, read or written.
enum class Fault {
  kUnreadable,    ///< It is not there, is no regular file, or the device failed.
  kForeign,       ///< It is something else: no GeoPackage, or none of ours.
  kOtherVersion,  ///< Its schema is older or newer than the one this version has.
  kInUse,         ///< Another process has it open.
  kReadOnly,      ///< It was to be changed and cannot be.
  kFull,          ///< There is no room on the device. Nothing was changed.
  kDamaged,       ///< Its content is not what was written.
  kUntrusted,     ///< It was to be changed, and SQL in it that is not ours would act then. Nothing
                  ///< was changed.
  kRefused,  ///< What was to be done makes no sense: a map or a change that it has not, a value
             ///< that a map cannot have. Nothing was changed.
};

/// what() is one line that names the file.
class MapFileError : public std::runtime_error {
 public:
  /// From the kind of fault and the line that what() gives.
  MapFileError(Fault fault, const std::string& line) : std::runtime_error(line), fault_(fault) {}
  /// The kind of fault.
  Fault fault() const { return fault_; }

 private:
  Fault fault_;
};

}  // namespace understory::map_file
