// Every allocation of this program goes through these, so that a test can count them.
#include <atomic>
#include <cstdlib>
#include <new>

#include "reference.h"

namespace {
std::atomic<long> allocations{0};

// Not inlined: the compiler would see memory of operator new handed to free and warn.
[[gnu::noinline]] void* allocate(std::size_t size, std::size_t alignment) noexcept {
  ++allocations;
  return alignment <= alignof(std::max_align_t)
             ? std::malloc(size)
             : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
}
[[gnu::noinline]] void release(void* memory) noexcept { std::free(memory); }

void* allocateOrThrow(std::size_t size, std::align_val_t alignment = std::align_val_t{1}) {
  if (void* memory = allocate(size, static_cast<std::size_t>(alignment))) return memory;
  throw std::bad_alloc();
}
}  // namespace

void* operator new(std::size_t size) { return allocateOrThrow(size); }
void* operator new[](std::size_t size) { return allocateOrThrow(size); }
void* operator new(std::size_t size, std::align_val_t alignment) { return allocateOrThrow(size, alignment); }
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return allocateOrThrow(size, alignment);
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return allocate(size, 1); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return allocate(size, 1); }
void operator delete(void* memory) noexcept { release(memory); }
void operator delete[](void* memory) noexcept { release(memory); }
void operator delete(void* memory, std::size_t) noexcept { release(memory); }
void operator delete[](void* memory, std::size_t) noexcept { release(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { release(memory); }
void operator delete[](void* memory, const std::nothrow_t&) noexcept { release(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { release(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { release(memory); }

namespace tendril {
namespace {

using namespace reference;

TEST(Memory, SolvingAllocatesNothingAfterTheFirstCall) {
  Random random(31);
  const RodProperties rod = rodOf(roundStiffness());
  RodProperties coil = rodOf(unevenStiffness());
  for (int i = 0; i < coil.elements; ++i) coil.rest_curvature.push_back(randomVector(random, 3));
  EquilibriumIntegrator light(rod), heavy(rod, gravityFor(rod, 20, {0, 0, -1})), uneven(coil);
  EquilibriumBatch batch(rod);
  Equilibrium e;
  EquilibriumEnd end;
  std::vector<Vector6> wrenches;
  for (int i = 0; i < 300; ++i) wrenches.push_back(randomWrench(random, 6, 40));
  std::vector<EquilibriumEnd> ends(wrenches.size());
  bool stable[300];
  const auto everything = [&](const Vector6& a) {
    for (EquilibriumIntegrator* integrator : {&light, &heavy, &uneven}) {
      (void)integrator->solve({}, a, e);
      (void)integrator->shape({}, a, e);
      (void)integrator->isStable(a);
      (void)integrator->end(a, end);
    }
    batch.shapes(wrenches, ends);
    batch.ends(wrenches, ends);
    batch.areStable(wrenches, stable);
  };
  const long at_start = allocations;
  everything(vector6(6, 6, 6, 40, 40, 40));
  const long before = allocations;
  ASSERT_GT(before, at_start);
  for (int i = 0; i < 20; ++i) everything(randomWrench(random, 6, 40));
  EXPECT_EQ(allocations - before, 0);
}

}  // namespace
}  // namespace tendril
