#include "common/map_file/map_file.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "common/map_file/check.hpp"
#include "common/map_file/drive_file.hpp"
#include "common/map_file/existence_rows.hpp"
#include "common/map_file/foreign_edits.hpp"
#include "common/map_file/map_rows.hpp"
#include "common/map_file/opening.hpp"
#include "common/map_file/reference_rows.hpp"
#include "common/map_file/schema.hpp"
#include "common/map_file/submap_layers.hpp"

namespace understory::map_file {
namespace {

std::uint64_t rows_of(const Connection& connection, std::string_view table, std::uint32_t map_id,
                      std::string_view condition = "") {
  Statement count = connection.prepare(
      fmt::format("SELECT count(*) FROM {} WHERE map_id = ?1 {}", table, condition));
  count.bind(std::int64_t{map_id}).step();
  return count.count(0);
}

MapSummary summary_of(const Connection& connection, std::uint32_t map_id) {
  Statement row = connection.prepare(
      "SELECT name, created_utime, origin, checksum FROM understory_maps WHERE map_id = ?1");
  row.bind(std::int64_t{map_id}).step();
  const ExistenceCounts existence = count_existence(connection, map_id);
  return {map_id,
          row.text(0),
          row.integer(1),
          row.text(2),
          row.text(3),
          rows_of(connection, "landmarks", map_id, "AND kind = 'trunk'"),
          rows_of(connection, "landmarks", map_id, "AND kind = 'corner'"),
          rows_of(connection, "trajectory", map_id),
          rows_of(connection, "submap_borders", map_id),
          rows_of(connection, "loop_closures", map_id),
          existence.states,
          existence.unused};
}

/// Runs a change as one transaction: `work` changes rows, which are recorded.
template <class Work>
std::uint64_t changed(const Connection& connection, const ChangeNote& note, const Work& work) {
  Transaction transaction(connection);
  std::uint64_t number = 0;
  {
    Recording recording(connection);
    work();
    number = recording.write(note);
  }
  refresh_contents(connection, note.utime);
  transaction.commit();
  return number;
}

void replace_maps(const Connection& connection, std::span<const StoredMap> maps) {
  for (const StoredMap& map : maps) {
    // Otherwise changes by another program would be recorded as ours.
    if (!stated_checksum(connection, map.map_id).empty()) verify_checksum(connection, map.map_id);
    delete_map(connection, map.map_id);
    insert_map(connection, map);
  }
}

void place(const Connection& connection, std::uint32_t map_id, const Placement& placement) {
  for (const model::SubmapPose& one : placement.submaps)
    place_submap(connection, {{map_id, one.id}, one.map_T_submap});
  std::vector<model::LoopClosure> known = select_closures(connection, map_id);
  for (model::LoopClosure closure : placement.closures) {
    if (std::ranges::find(known, closure.id, &model::LoopClosure::id) != known.end())
      throw MapFileError(Fault::kRefused,
                         fmt::format("{}: map {} has a closure {} already",
                                     connection.file().string(), map_id, closure.id));
    closure.map_id = map_id;
    insert_closure(connection, closure);
    known.push_back(closure);
  }
}

/// Files of version 1 have no submaps.
bool has_submaps(const Connection& connection) { return schema_version(connection) >= 2; }

/// A drive whose store was killed is sealed first.
std::unique_ptr<Connection> opened(const std::filesystem::path& file, Access access) {
  if (access == Access::kRead) {
    auto connection = open_to_read(file);
    if (!is_open_drive(*connection)) return connection;
  }
  auto writer = open_to_write(file);
  if (is_open_drive(*writer)) seal_drive(*writer);
  if (access == Access::kWrite) return writer;
  leave(*writer);
  writer.reset();
  return open_to_read(file);
}

}  // namespace

MapFile::MapFile(const std::filesystem::path& file, Access access)
    : connection_(opened(file, access)), access_(access) {}

MapFile::MapFile(MapFile&&) noexcept = default;

MapFile::~MapFile() {
  if (connection_ && access_ == Access::kWrite) leave(*connection_);
}

const std::filesystem::path& MapFile::file() const { return connection_->file(); }

std::vector<MapSummary> MapFile::maps() const {
  std::vector<MapSummary> maps;
  const std::vector<std::uint32_t> ids = map_ids(*connection_);
  maps.reserve(ids.size());
  for (const std::uint32_t id : ids) maps.push_back(summary_of(*connection_, id));
  return maps;
}

StoredMap MapFile::read(std::uint32_t map_id) const {
  StoredMap map = select_map(*connection_, map_id);
  verify_checksum(*connection_, map_id);
  return map;
}

std::vector<model::Submap> MapFile::submaps(std::uint32_t map_id) const {
  std::vector<model::Submap> submaps;
  if (!has_submaps(*connection_)) return submaps;
  for (const SubmapKey& key : stored_submaps(*connection_))
    if (key.map_id == map_id) submaps.push_back(select_submap(*connection_, key).value());
  return submaps;
}

std::vector<model::LoopClosure> MapFile::closures(std::uint32_t map_id) const {
  if (!has_submaps(*connection_)) return {};
  return select_closures(*connection_, map_id);
}

std::optional<model::MapReference> MapFile::reference() const {
  return select_reference(*connection_);
}

std::vector<Change> MapFile::history() const { return changes_in(*connection_); }

std::string MapFile::program_version() const { return program_of(*connection_); }

std::vector<std::string> MapFile::check() const { return findings_in(*connection_); }

std::uint64_t MapFile::put(std::span<const StoredMap> maps, const ChangeNote& note) {
  return changed(*connection_, note, [&] { replace_maps(*connection_, maps); });
}

std::uint64_t MapFile::put(const StoredMap& map, const Placement& placement,
                           const ChangeNote& note) {
  return changed(*connection_, note, [&] {
    replace_maps(*connection_, {&map, 1});
    place(*connection_, map.map_id, placement);
  });
}

std::uint64_t MapFile::put(const model::MapReference& reference, const ChangeNote& note) {
  return changed(*connection_, note, [&] {
    for (const std::uint32_t id : map_ids(*connection_)) verify_checksum(*connection_, id);
    put_reference(*connection_, reference);
    for (const std::uint32_t id : map_ids(*connection_)) state_checksum(*connection_, id);
  });
}

std::uint64_t MapFile::revert(std::uint64_t to, const ChangeNote& note) {
  std::uint64_t latest = latest_change(*connection_);
  if (to > latest)
    throw MapFileError(Fault::kRefused, fmt::format("{}: has no change {}, the latest one is {}",
                                                    file().string(), to, latest));

  const auto recorded = recorded_content(*connection_);
  if (!is_as_recorded(*connection_, *recorded)) {
    ChangeNote foreign = note;
    foreign.text = "changed by another program, before " + note.text;
    latest = record_foreign_edits(*connection_, *recorded, foreign, false);
  }

  return changed(*connection_, note, [&] {
    for (std::uint64_t number = latest; number > to; --number) undo(*connection_, number);
    for (const std::uint32_t id : map_ids(*connection_)) verify_checksum(*connection_, id);
  });
}

std::uint64_t MapFile::accept(const ChangeNote& note) {
  const auto recorded = recorded_content(*connection_);
  if (is_as_recorded(*connection_, *recorded))
    throw MapFileError(Fault::kRefused,
                       fmt::format("{}: its maps are what its history says", file().string()));
  return record_foreign_edits(*connection_, *recorded, note, true);
}

void create_map_file(const std::filesystem::path& file, std::span<const StoredMap> maps,
                     const ChangeNote& note, const std::optional<model::MapReference>& reference) {
  NewFile part(file);
  {
    Connection connection(part.path(), Access::kWrite, file);
    connection.execute("PRAGMA foreign_keys = ON");
    Transaction transaction(connection);
    create_schema(connection);
    Recording recording(connection);
    if (reference) put_reference(connection, *reference);
    replace_maps(connection, maps);
    recording.write(note);
    refresh_contents(connection, note.utime);
    transaction.commit();
  }
  part.move_to_its_name();
}

}  // namespace understory::map_file
