// The store's files: one for each drive, numbered.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/map_file/drive_file.hpp"
#include "services/submap_store/parameters.hpp"

namespace understory::submap_store {

/// A file in which the drive cannot continue, and its fault.
struct PassedOver {
  map_file::Fault fault = map_file::Fault::kDamaged;
  std::string line;  ///< For a person; contains the file's name.
};

/// A folder of files drive-0001.gpkg, drive-0002.gpkg and so on; at most the last one is open. All
/// errors are map_file::MapFileError, with one line that contains the file's name.
///
/// A file that cannot be used is skipped: the drive continues in the next number. A damaged file,
/// or one that is no map, is renamed with the suffix `.set-aside` if possible; a map that cannot be
/// written stays as it is. Nothing is deleted.
class DriveFolder {
 public:
  /// Uses a folder, and creates it if it is missing.
  DriveFolder(std::filesystem::path folder, const FolderParameters& parameters);
  /// Uses a temporary folder of its own, deleted by the destructor: for replay and experiments.
  /// Throws std::runtime_error if it cannot be created.
  explicit DriveFolder(const FolderParameters& parameters);
  ~DriveFolder();
  DriveFolder(const DriveFolder&) = delete;
  DriveFolder& operator=(const DriveFolder&) = delete;

  /// The file of the drive of a message with this stamp. If none is open: the previous one, or the
  /// folder's last one, if its drive may continue; else a new one. Throws if another process has it
  /// open, if there is no space left, or if it must be skipped and no other one can be created:
  /// then the next call tries again.
  map_file::DriveFile& at(model::Utime utime);
  /// The files skipped since the last call.
  std::vector<PassedOver> take_passed_over() { return std::exchange(passed_over_, {}); }
  /// A submap from files of this drive that were skipped during it, as far as they are readable.
  std::optional<model::Submap> find_passed_over(const map_file::SubmapKey& key) const;
  /// The open file; null if none is open.
  map_file::DriveFile* current() { return file_.get(); }
  /// Ends the drive of the file like finish(); the next at() creates another one.
  void begin_drive();
  /// Closes the file after a fault; the next at() opens it again.
  void close() { file_.reset(); }
  /// Closes a damaged file; the next at() skips it.
  void give_up(const map_file::MapFileError& fault);
  /// Seals the file, within the time that the parameters allow, and closes it. Never throws. False
  /// if a part is left: the next process that opens the file completes it.
  bool finish() noexcept;

 private:
  bool may_go_on_at(model::Utime utime) const;
  void make_folder() const;
  bool open_last(model::Utime utime);
  void make_next();
  void pass_over(int number, const map_file::MapFileError& fault);
  std::filesystem::path name_of(int number) const;
  int last_number() const;

  std::filesystem::path folder_;
  FolderParameters parameters_;
  bool is_temporary_ = false;
  std::optional<int> number_;  ///< Number of this drive's file.
  std::unique_ptr<map_file::DriveFile> file_;
  std::optional<map_file::MapFileError>
      given_up_;                         ///< Reason why this drive's file is not opened again.
  std::vector<PassedOver> passed_over_;  ///< Not reported yet.
  std::vector<std::filesystem::path> earlier_;  ///< Skipped files of this drive.
};

}  // namespace understory::submap_store
