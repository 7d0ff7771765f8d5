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

/// A file that the drive does not go on in, and what became of it.
struct PassedOver {
  map_file::Fault fault = map_file::Fault::kDamaged;
  std::string line;  ///< For a person; names the file.
};

/// A folder of files drive-0001.gpkg, drive-0002.gpkg and so on, of which the last one may be open.
/// Everything throws map_file::MapFileError, whose one line names the file.
///
/// A file that cannot be gone on in is passed over: the drive goes on in the next number. What is
/// damaged, or no map, is set aside under its name with `.set-aside` behind it, where it can be
/// renamed; a map that cannot be written stays as it is. Nothing is deleted.
class DriveFolder {
 public:
  /// In a folder that is made where it is not there.
  DriveFolder(std::filesystem::path folder, const FolderParameters& parameters);
  /// In a folder of its own that is gone with this: for replay and experiments. Throws
  /// std::runtime_error where none can be made.
  explicit DriveFolder(const FolderParameters& parameters);
  ~DriveFolder();
  DriveFolder(const DriveFolder&) = delete;
  DriveFolder& operator=(const DriveFolder&) = delete;

  /// The file of the drive that a message with this stamp is of. Where none is open: the one that
  /// was, or the folder's last one, where its drive may go on; else a new one. Throws where another
  /// process has it, where there is no room, or where it is to be passed over and no other one can
  /// be made: then the next call tries again.
  map_file::DriveFile& at(model::Utime utime);
  /// The files that were passed over since the last call.
  std::vector<PassedOver> take_passed_over() { return std::exchange(passed_over_, {}); }
  /// A submap from files of this drive that were passed over while it went on, as far as they can
  /// be read.
  std::optional<model::Submap> find_passed_over(const map_file::SubmapKey& key) const;
  /// The file that is open; null where none is.
  map_file::DriveFile* current() { return file_.get(); }
  /// Ends the drive of the file as finish() does; the next at() makes another one.
  void begin_drive();
  /// Something is wrong with the file: closes it; the next at() opens it anew.
  void close() { file_.reset(); }
  /// The file turned out to be damaged: closes it; the next at() passes it over.
  void give_up(const map_file::MapFileError& fault);
  /// Seals the file, as far as that takes no longer than the parameters allow, and closes it. Never
  /// throws: what is left is done by who opens the file next. False where something is left.
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
  std::optional<int> number_;  ///< Of this drive's file.
  std::unique_ptr<map_file::DriveFile> file_;
  std::optional<map_file::MapFileError> given_up_;  ///< Why this drive's file is not opened again.
  std::vector<PassedOver> passed_over_;             ///< Not reported yet.
  std::vector<std::filesystem::path> earlier_;  ///< Files of this drive that it went on without.
};

}  // namespace understory::submap_store
