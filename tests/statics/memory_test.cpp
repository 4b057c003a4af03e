// Every allocation of this program goes through these, so that a test can count them.
#include <gtest/gtest.h>

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

TEST(Statics, SolvingAllocatesNothingAfterTheFirstCall) {
  Random random(31);
  EquilibriumIntegrator integrator(rodOf(roundStiffness()));
  Equilibrium e;
  Pose end;
  Matrix6 jacobian;
  (void)integrator.solve({}, vector6(6, 6, 6, 40, 40, 40), e);
  (void)integrator.shape({}, vector6(6, 6, 6, 40, 40, 40), e);
  const long before = allocations;
  ASSERT_GT(before, 0);
  for (int i = 0; i < 100; ++i) {
    const Vector6 a = randomWrench(random, 6, 40);
    (void)integrator.solve({}, a, e);
    (void)integrator.shape({}, a, e);
    (void)integrator.isStable(a);
    (void)integrator.endPose(a, end, jacobian);
  }
  EXPECT_EQ(allocations - before, 0);
}

}  // namespace
}  // namespace tendril
