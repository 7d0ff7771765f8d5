// A stage's state as bytes. Writing and reading use the same list of members, so that no member is
// listed twice.
//
// A type lists its members once, as a static member function or as a free function beside the type:
//
//   template <class Archive, class Self>
//   static void archive(Archive& a, Self& self) {
//     a(self.first_, self.second_);
//     if constexpr (Archive::kReads) self.rebuild_index();
//   }
//
// save() and load() add the format's name and version at the front.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <deque>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/geometry/se2.hpp"

namespace understory::state {

static_assert(std::endian::native == std::endian::little, "states are stored in little endian");

/// Identifies the list of members in the bytes. `version` increases with every change of that list.
struct Format {
  std::string_view name;
  std::uint32_t version = 1;
};

/// A type stored as its bytes.
template <class T>
concept Number = std::is_arithmetic_v<T> || std::is_enum_v<T>;
/// An Eigen matrix of fixed size.
template <class T>
concept FixedMatrix =
    std::derived_from<T, Eigen::PlainObjectBase<T>> && T::SizeAtCompileTime != Eigen::Dynamic;
/// An Eigen matrix of dynamic size, stored after its numbers of rows and columns.
template <class T>
concept DynamicMatrix =
    std::derived_from<T, Eigen::PlainObjectBase<T>> && T::SizeAtCompileTime == Eigen::Dynamic;

template <class T>
constexpr bool kIsList = false;
template <class T>
constexpr bool kIsList<std::vector<T>> = true;
template <class T>
constexpr bool kIsList<std::deque<T>> = true;
template <>
inline constexpr bool kIsList<std::string> = true;
template <class T>
constexpr bool kIsMap = false;
template <class K, class V>
constexpr bool kIsMap<std::map<K, V>> = true;
template <class T>
constexpr bool kIsOptional = false;
template <class T>
constexpr bool kIsOptional<std::optional<T>> = true;
template <class T>
constexpr bool kIsArray = false;
template <class T, std::size_t N>
constexpr bool kIsArray<std::array<T, N>> = true;
template <class T>
constexpr bool kIsPair = false;
template <class A, class B>
constexpr bool kIsPair<std::pair<A, B>> = true;

template <class T>
constexpr bool kIsContainer =
    kIsOptional<T> || kIsPair<T> || kIsArray<T> || kIsMap<T> || kIsList<T>;

/// True for `Self` = T and const T: constrains a free archive() to one type.
template <class Self, class T>
concept Is = std::same_as<std::remove_const_t<Self>, T>;

/// Appends values to bytes.
class Writer {
 public:
  static constexpr bool kReads = false;

  /// Appends the values in sequence.
  template <class... Values>
  void operator()(const Values&... values) {
    (put(values), ...);
  }
  /// Bytes written so far.
  const std::string& bytes() const { return bytes_; }
  /// Moves out the written bytes.
  std::string take() { return std::move(bytes_); }

 private:
  template <class T>
  void put(const T& value) {
    if constexpr (Number<T>) {
      put_bytes(&value, sizeof(T));
    } else if constexpr (FixedMatrix<T>) {
      put_bytes(value.data(), sizeof(typename T::Scalar) * T::SizeAtCompileTime);
    } else if constexpr (DynamicMatrix<T>) {
      put(static_cast<std::uint64_t>(value.rows()));
      put(static_cast<std::uint64_t>(value.cols()));

      put_bytes(value.data(), sizeof(typename T::Scalar) * static_cast<std::size_t>(value.size()));
    } else if constexpr (std::same_as<T, Eigen::Quaterniond>) {
      put(value.coeffs());
    } else if constexpr (std::same_as<T, geometry::SE2>) {
      put(value.coordinates());
    } else if constexpr (std::same_as<T, geometry::SE2WithCovariance>) {
      put(value.mean);
      put(value.covariance);
    } else if constexpr (kIsOptional<T>) {
      put(value.has_value());
      if (value) put(*value);
    } else if constexpr (kIsPair<T>) {
      put(value.first);
      put(value.second);
    } else if constexpr (kIsArray<T>) {
      for (const auto& element : value) put(element);
    } else if constexpr (kIsMap<T>) {
      put(static_cast<std::uint64_t>(value.size()));

      for (const auto& [key, element] : value) {
        put(key);
        put(element);
      }
    } else if constexpr (kIsList<T>) {
      put(static_cast<std::uint64_t>(value.size()));

      for (const auto& element : value) put(element);
    } else if constexpr (requires { T::archive(*this, value); }) {
      T::archive(*this, value);
    } else {
      archive(*this, value);
    }
  }
  void put_bytes(const void* from, std::size_t size) {
    bytes_.append(static_cast<const char*>(from), size);
  }

  std::string bytes_;
};

/// Reads values from the bytes of a Writer. Throws std::invalid_argument where bytes are missing.
class Reader {
 public:
  static constexpr bool kReads = true;

  /// `bytes` must outlive the reader.
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}
  /// Fills the values in the order in which they were written.
  template <class... Values>
  void operator()(Values&... values) {
    (get(values), ...);
  }
  /// True when all bytes are read.
  bool is_at_end() const { return bytes_.empty(); }

 private:
  template <class T>
  void get(T& value) {
    if constexpr (std::same_as<T, bool>) {
      std::uint8_t byte = 0;
      get_bytes(&byte, sizeof(byte));
      value = byte != 0;
    } else if constexpr (Number<T>) {
      get_bytes(&value, sizeof(T));
    } else if constexpr (FixedMatrix<T>) {
      get_bytes(value.data(), sizeof(typename T::Scalar) * T::SizeAtCompileTime);
    } else if constexpr (DynamicMatrix<T>) {
      std::uint64_t rows = 0;
      std::uint64_t cols = 0;
      get(rows);
      get(cols);
      // One side of an empty matrix may exceed the remaining bytes.
      if (std::max(rows, cols) > kLongestSide) fail();
      if (rows != 0 && cols > bytes_.size() / sizeof(typename T::Scalar) / rows) fail();

      value.resize(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(cols));
      get_bytes(value.data(), sizeof(typename T::Scalar) * static_cast<std::size_t>(value.size()));
    } else if constexpr (std::same_as<T, Eigen::Quaterniond>) {
      get(value.coeffs());
    } else if constexpr (std::same_as<T, geometry::SE2>) {
      Eigen::Vector3d coordinates;
      get(coordinates);
      value = geometry::SE2(coordinates.head<2>(), coordinates.z());
    } else if constexpr (std::same_as<T, geometry::SE2WithCovariance>) {
      get(value.mean);
      get(value.covariance);
    } else if constexpr (kIsContainer<T>) {
      get_container(value);
    } else if constexpr (requires { T::archive(*this, value); }) {
      T::archive(*this, value);
    } else {
      archive(*this, value);
    }
  }
  template <class T>
  void get_container(T& value) {
    if constexpr (kIsOptional<T>) {
      bool is_there = false;
      get(is_there);
      value.reset();
      if (is_there) get(value.emplace());
    } else if constexpr (kIsPair<T>) {
      get(value.first);
      get(value.second);
    } else if constexpr (kIsArray<T>) {
      for (auto& element : value) get(element);
    } else if constexpr (kIsMap<T>) {
      value.clear();

      for (std::uint64_t left = count(1); left > 0; --left) {
        typename T::key_type key{};
        get(key);
        get(value[key]);
      }
    } else if constexpr (std::same_as<T, std::vector<bool>>) {
      value.assign(count(1), false);

      for (std::size_t i = 0; i < value.size(); ++i) {
        bool bit = false;
        get(bit);
        value[i] = bit;
      }
    } else if constexpr (kIsList<T>) {
      value.clear();

      for (std::uint64_t left = count(1); left > 0; --left) {
        typename T::value_type element{};
        get(element);
        value.push_back(std::move(element));
      }
    }
  }
  /// Reads a number of elements of at least `least_bytes` each, so that a damaged number requests
  /// no memory.
  std::uint64_t count(std::size_t least_bytes) {
    std::uint64_t size = 0;
    get(size);
    if (size > bytes_.size() / least_bytes) fail();
    return size;
  }
  void get_bytes(void* to, std::size_t size) {
    if (size > bytes_.size()) fail();
    if (size > 0) std::memcpy(to, bytes_.data(), size);
    bytes_.remove_prefix(size);
  }
  [[noreturn]] static void fail() { throw std::invalid_argument("state: it is cut off"); }

  static constexpr std::uint64_t kLongestSide = std::uint64_t{1} << 31U;

  std::string_view bytes_;
};

/// The bytes of the values, after the format's name and version.
template <class... Values>
std::string save(const Format& format, const Values&... values) {
  Writer out;
  out(std::string(format.name), format.version, values...);
  return out.take();
}

/// Reads the result of save() of the same format. Throws std::invalid_argument where the bytes have
/// another format or version, are cut off or too long; the values are then undefined.
template <class... Values>
void load(std::string_view bytes, const Format& format, Values&... values) {
  Reader in(bytes);
  std::string name;
  std::uint32_t version = 0;
  in(name, version);
  if (name != format.name || version != format.version) {
    throw std::invalid_argument("state: of another stage or version; expected " +
                                std::string(format.name) + " version " +
                                std::to_string(format.version));
  }
  in(values...);
  if (!in.is_at_end()) throw std::invalid_argument("state: there are bytes behind its end");
}

}  // namespace understory::state
