#include "tendril/statics/library.h"

#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string>

namespace tendril::statics {
namespace {

constexpr std::size_t kSize = 4000;
constexpr std::uint64_t kSeed = 2014;
constexpr std::size_t kDrawsAtOnce = 1024, kMostDraws = 100 * kSize;
/// Of the file's format and of how a library is made: changed with either.
constexpr char kVersion[] = "tendril rod library 3\n";

/// The straight unloaded rod, rods loaded along one axis, and random stable rods of the default sampling box.
/// A rod so soft in shear or stretch that the box's forces would crush it gets smaller ones; should few of
/// these be stable it has the library those few make.
Library build(const NaturalRod& rod) {
  NaturalRod weightless = rod;
  weightless.weight.setZero();
  Batch batch(weightless);
  Library library;
  const auto add = [&](const std::vector<Vector6>& wrenches) {
    batch.ends(wrenches, kQuick, true, [&](std::size_t i, const NaturalEnd& end) {
      if (!end.stable || library.rods.size() == kSize) return;
      library.rods.push_back({wrenches[i], end.end, end.energy});
      library.jacobians.push_back(end.jacobian);
    });
  };
  const SamplingBox box;
  const double force = std::min(box.force, rod.c.tail<3>().minCoeff());
  std::vector<Vector6> wrenches = {Vector6::Zero()};
  for (int axis = 0; axis < 6; ++axis)
    for (const double part : {0.2, 0.4, 0.6, 0.8, 1.0})
      for (const double sign : {1.0, -1.0})
        wrenches.push_back(sign * part * (axis < 3 ? 6.0 : 0.875 * force) * Vector6::Unit(axis));
  add(wrenches);
  Random random(kSeed);
  wrenches.resize(kDrawsAtOnce);
  for (std::size_t draws = 0; library.rods.size() < kSize && draws < kMostDraws; draws += kDrawsAtOnce) {
    for (Vector6& a : wrenches) {
      for (int i = 0; i < 3; ++i) a[i] = random.uniform(-box.moment, box.moment);
      for (int i = 3; i < 6; ++i) a[i] = random.uniform(-force, force);
    }
    add(wrenches);
  }
  return library;
}

void append(std::string& bytes, const double* numbers, std::size_t count) {
  bytes.append(reinterpret_cast<const char*>(numbers), count * sizeof(double));
}

/// Everything a library depends on, as bytes.
std::string keyOf(const NaturalRod& rod) {
  std::string key = kVersion;
  append(key, rod.c.data(), 6);
  for (const Vector3& k : rod.kappa0) append(key, k.data(), 3);
  return key;
}

constexpr std::size_t kNumbers = 14 + 36;  // of one rod

std::string bytesOf(const Library& library) {
  std::string bytes;
  for (std::size_t i = 0; i < library.rods.size(); ++i) {
    const LibraryRod& rod = library.rods[i];
    append(bytes, rod.a.data(), 6);
    append(bytes, rod.end.rotation.coeffs().data(), 4);
    append(bytes, rod.end.position.data(), 3);
    append(bytes, &rod.energy, 1);
    append(bytes, library.jacobians[i].data(), 36);
  }
  return bytes;
}

Library libraryOf(std::string_view bytes) {
  Library library;
  for (std::size_t i = 0; i < bytes.size() / (kNumbers * sizeof(double)); ++i) {
    double n[kNumbers];
    std::memcpy(n, bytes.data() + i * sizeof n, sizeof n);
    library.rods.push_back(
        {Vector6::Map(n), {Quaternion(n[9], n[6], n[7], n[8]), Vector3::Map(n + 10)}, n[13]});
    library.jacobians.emplace_back(Matrix6::Map(n + 14));
  }
  return library;
}

/// Where libraries are kept; empty if nowhere.
std::filesystem::path cacheFolder() {
  if (const char* own = std::getenv("TENDRIL_CACHE")) return own;
  if (const char* xdg = std::getenv("XDG_CACHE_HOME"); xdg && *xdg)
    return std::filesystem::path(xdg) / "tendril";
  if (const char* home = std::getenv("HOME"); home && *home)
    return std::filesystem::path(home) / ".cache" / "tendril";
  return {};
}

/// A library file is the key, the SHA-256 of the rest in hexadecimal, and the rods. One that is not whole is
/// as good as none.
Library load(const std::filesystem::path& file, const std::string& key) {
  try {
    const std::string bytes = readFile(file);
    const std::string_view all = bytes;
    if (!all.starts_with(key) || all.size() < key.size() + 64) return {};
    const std::string_view rods = all.substr(key.size() + 64);
    if (rods.size() % (kNumbers * sizeof(double)) != 0 || all.substr(key.size(), 64) != sha256Hex(rods))
      return {};
    return libraryOf(rods);
  } catch (const InputError&) {
    return {};
  }
}

Library loadOrBuild(const NaturalRod& rod, const std::string& key) {
  const std::filesystem::path folder = cacheFolder();
  if (folder.empty()) return build(rod);
  const std::filesystem::path file = folder / ("rods-" + sha256Hex(key) + ".bin");
  std::error_code unused;
  if (std::filesystem::exists(file, unused))
    if (Library library = load(file, key); !library.rods.empty()) return library;
  Library library = build(rod);
  try {
    const std::string rods = bytesOf(library);
    writeFileAtomically(file, key + sha256Hex(rods) + rods);
  } catch (const InputError&) {  // a cache that cannot be written is no cache
  }
  return library;
}

}  // namespace

std::shared_ptr<const Library> libraryFor(const NaturalRod& rod) {
  constexpr std::size_t kKept = 4;
  static std::mutex mutex;
  static std::vector<std::pair<std::string, std::shared_ptr<const Library>>> kept;
  const std::string key = keyOf(rod);
  const std::lock_guard lock(mutex);
  for (const auto& [name, library] : kept)
    if (name == key) return library;
  if (kept.size() == kKept) kept.erase(kept.begin());
  kept.emplace_back(key, std::make_shared<const Library>(loadOrBuild(rod, key)));
  return kept.back().second;
}

}  // namespace tendril::statics
