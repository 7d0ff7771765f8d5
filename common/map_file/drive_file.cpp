#include "common/map_file/drive_file.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>

#include "common/map_file/existence_rows.hpp"
#include "common/map_file/foreign_edits.hpp"
#include "common/map_file/map_rows.hpp"
#include "common/map_file/opening.hpp"
#include "common/map_file/schema.hpp"
#include "common/map_file/submap_tables.hpp"

namespace understory::map_file {
namespace {

/// Submaps drawn in one transaction at sealing.
constexpr std::size_t kDrawnTogether = 50;

std::string meta(const Connection& connection, std::string_view key) {
  Statement row = connection.prepare("SELECT value FROM understory_meta WHERE key = ?1");
  return row.bind(key).step() ? row.text(0) : std::string();
}

void set_meta(const Connection& connection, std::string_view key, std::int64_t value) {
  connection.prepare("INSERT OR REPLACE INTO understory_meta VALUES (?1, ?2)")
      .bind(key, std::string_view(std::to_string(value)))
      .run();
}

/// Reads an integer; none where there is none.
std::optional<std::int64_t> number_in(const std::string& text) {
  try {
    std::size_t end = 0;
    const std::int64_t value = std::stoll(text, &end);
    if (end == text.size()) return value;
  } catch (const std::exception&) {
  }
  return std::nullopt;
}

std::size_t draw_some(const Connection& connection, std::size_t most) {
  const std::vector<PlacedSubmap> moved = to_draw(connection, most);
  if (moved.empty()) return 0;
  Transaction transaction(connection);
  for (const PlacedSubmap& one : moved) {
    redraw_submap(connection, one);
    set_drawn(connection, one.key);
  }
  transaction.commit();
  return moved.size();
}

ChangeNote note_of_drive(const Connection& connection) {
  const auto newest = number_in(meta(connection, drive_key::kNewest));
  const std::int64_t maps = connection.number("SELECT count(*) FROM understory_maps");
  const std::int64_t submaps =
      connection.number("SELECT count(*) FROM understory_submaps WHERE state != 'replaced'");
  return {newest.value_or(0), "understory-submap-store", "a drive",
          fmt::format("{} maps, {} submaps", maps, submaps)};
}

}  // namespace

bool is_open_drive(const Connection& connection) {
  return !meta(connection, drive_key::kOpen).empty();
}

void seal_drive(const Connection& connection) {
  while (draw_some(connection, kDrawnTogether) > 0) {
  }
  {
    Transaction transaction(connection);
    redraw_closures(connection);
    settle_existence(connection);
    transaction.commit();
  }

  // Changes by other programs in between are not recorded separately.
  const auto recorded = recorded_content(connection);
  if (!is_as_recorded(connection, *recorded))
    record_foreign_edits(connection, *recorded, note_of_drive(connection), false);

  Transaction transaction(connection);
  set_meta(connection, drive_key::kSealed, static_cast<std::int64_t>(latest_change(connection)));
  connection.prepare("DELETE FROM understory_meta WHERE key = ?1").bind(drive_key::kOpen).run();
  transaction.commit();
}

void DriveFile::make(const std::filesystem::path& file) {
  NewFile part(file);
  {
    const Connection connection(part.path(), Access::kWrite, file);
    Transaction transaction(connection);
    create_schema(connection);
    transaction.commit();
  }
  part.move_to_its_name();
}

DriveFile::DriveFile(const std::filesystem::path& file, bool is_lasting)
    : connection_(open_to_write(file)) {
  if (!is_lasting) connection_->execute("PRAGMA synchronous = OFF");
  struct ::stat found {};
  if (::stat(file.c_str(), &found) != 0) return;
  device_ = found.st_dev;
  inode_ = found.st_ino;
}

void DriveFile::require_in_place() const {
  struct ::stat found {};
  const bool is_there = ::stat(file().c_str(), &found) == 0;
  if (!is_there || found.st_dev != device_ || found.st_ino != inode_)
    throw MapFileError(Fault::kUnreadable,
                       fmt::format("{}: is not the file that was opened", file().string()));
  const auto size = static_cast<std::uint64_t>(found.st_size);
  if (size < largest_) connection_->damaged("it was cut");
  largest_ = size;
}

DriveFile::~DriveFile() { leave(*connection_); }

const std::filesystem::path& DriveFile::file() const { return connection_->file(); }

bool DriveFile::may_go_on() const {
  if (is_open_drive(*connection_)) return true;
  const std::uint64_t latest = latest_change(*connection_);
  if (latest == 0) return true;
  return number_in(meta(*connection_, drive_key::kSealed)) == static_cast<std::int64_t>(latest);
}

std::optional<model::Utime> DriveFile::newest() const {
  return number_in(meta(*connection_, drive_key::kNewest));
}

std::uint32_t DriveFile::highest_map() const {
  const std::vector<std::uint32_t> ids = map_ids(*connection_);
  return ids.empty() ? 0 : ids.back();
}

/// Begins a transaction that changes the layers.
void DriveFile::begin(std::uint32_t map_id, model::Utime utime) {
  if (map_id < 1 || map_id > kLastMapId)
    throw MapFileError(Fault::kRefused,
                       fmt::format("{}: map {} is not stored: its number is not within 1 to {}",
                                   file().string(), map_id, kLastMapId));
  connection_->prepare("INSERT OR IGNORE INTO understory_meta VALUES (?1, '1')")
      .bind(drive_key::kOpen)
      .run();
  set_meta(*connection_, drive_key::kNewest, std::max(newest().value_or(utime), utime));
  state_program(*connection_);
  connection_
      ->prepare(
          "INSERT OR IGNORE INTO understory_maps (map_id, name, created_utime, origin, checksum) "
          "VALUES (?1, ?2, ?3, ?4, '')")
      .bind(std::int64_t{map_id}, std::string_view(file().stem().string()), std::int64_t{utime},
            std::string_view("a drive"))
      .run();
}

Keeping DriveFile::put(const model::Submap& submap, const geometry::SE2& map_T_submap) {
  const auto state = state_of(*connection_, {submap.map_id, submap.id});
  if (state)
    return state->content_hash == submap.content_hash ? Keeping::kAlready : Keeping::kOther;

  Transaction transaction(*connection_);
  begin(submap.map_id, submap.utime);
  for (const model::SubmapId id : submap.replaced) {
    hide_submap(*connection_, {submap.map_id, id});
    replace_submap(*connection_, {submap.map_id, id});
  }
  insert_submap(*connection_, submap, map_T_submap);
  show_submap(*connection_, submap, map_T_submap);
  transaction.commit();
  return Keeping::kNew;
}

std::optional<model::Submap> DriveFile::get(const SubmapKey& key) const {
  return select_submap(*connection_, key);
}

void DriveFile::put(const model::MapCorrection& correction) {
  Transaction transaction(*connection_);
  begin(correction.map_id, correction.utime);
  for (const PlacedSubmap& one : update_poses(*connection_, correction))
    redraw_border(*connection_, one);
  transaction.commit();
}

std::size_t DriveFile::put(const GroundChange& change) {
  Transaction transaction(*connection_);
  begin(change.map_id, change.utime);
  const std::size_t left_out = show_ground(*connection_, change);
  transaction.commit();
  return left_out;
}

void DriveFile::put(std::uint32_t map_id, const StoredExistence& existence) {
  if (!std::ranges::binary_search(map_ids(*connection_), map_id)) return;
  model::Utime newest = existence.utime;
  for (const ExistenceRow& row : existence.landmarks) newest = std::max(newest, row.utime);

  Transaction transaction(*connection_);
  begin(map_id, newest);
  put_existence(*connection_, map_id, existence);
  transaction.commit();
}

void DriveFile::put(const model::ExistenceState& state) {
  const std::string fault = fault_of(state);
  if (!fault.empty())
    throw MapFileError(Fault::kRefused, fmt::format("{}: {}", file().string(), fault));
  NewestExistence existence;
  existence.take(state);
  put(state.map_id, existence.stored());
}

void DriveFile::put(const model::LoopClosure& closure) {
  Transaction transaction(*connection_);
  begin(closure.map_id, closure.utime);
  put_closure(*connection_, closure);
  transaction.commit();
}

void DriveFile::take_back(std::uint32_t map_id, std::uint64_t closure_id) {
  Transaction transaction(*connection_);
  begin(map_id, newest().value_or(0));
  remove_closure(*connection_, map_id, closure_id);
  transaction.commit();
}

void DriveFile::drop(std::uint32_t map_id) {
  Transaction transaction(*connection_);
  begin(map_id, newest().value_or(0));
  for (const std::string_view table :
       {"understory_submaps", "understory_submap_poses", "understory_closures"}) {
    connection_->prepare(fmt::format("DELETE FROM {} WHERE map_id = ?1", table))
        .bind(std::int64_t{map_id})
        .run();
  }
  delete_map(*connection_, map_id);
  transaction.commit();
}

std::size_t DriveFile::draw(std::size_t most) { return draw_some(*connection_, most); }

std::uint64_t DriveFile::size() const {
  return static_cast<std::uint64_t>(connection_->number(
      "SELECT (SELECT count(*) FROM landmarks) + (SELECT count(*) FROM trajectory) + "
      "(SELECT count(*) FROM existence_states)"));
}

std::optional<model::Submap> submap_in(const std::filesystem::path& file, const SubmapKey& key) {
  return select_submap(*open_to_read(file), key);
}

void DriveFile::seal() {
  if (is_open_drive(*connection_)) seal_drive(*connection_);
}

}  // namespace understory::map_file
