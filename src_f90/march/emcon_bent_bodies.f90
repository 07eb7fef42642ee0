!> Bodies that are bent and made of elements that are too stiff for it.
module emcon_bent_bodies
   use emcon_bending, only : bending_measure, bending_t
   use emcon_kinds, only : wp
   use emcon_locking, only : bending_advice
   use emcon_march_types, only : march_t
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_t
   use emcon_steps, only : step_square
   use emcon_term_registry, only : terms_solid
   implicit none
   private
   public :: bent_body_t, bent_body_find

   !> The first such body.
   type :: bent_body_t
      integer :: body = 0                        !! 0: none
      integer :: label = 0                       !! of its first element
      real(wp) :: percent = 0.0_wp               !! of its strain energy, in what resists
      character(len=:), allocatable :: advice
   end type bent_body_t

   !> Of the strain energy that part is told: the body is so much too stiff.
   real(wp), parameter :: told_part = 0.2_wp
   !> Strain energies below that part of the largest energy of a run are round-off.
   real(wp), parameter :: rounding = sqrt(epsilon(1.0_wp))

contains

   !> Look at the state of `march`, in whose run `largest_energy` was the largest.
   subroutine bent_body_find(march, scene, largest_energy, found)
      type(march_t), intent(in) :: march
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: largest_energy     !! [M L^2/T^2]
      type(bent_body_t), intent(out) :: found
      type(bending_t) :: bending
      type(solid_t), pointer :: solid
      integer :: b

      found%advice = ""
      solid => terms_solid(march%system%term)
      if (.not. any(solid%trait%is_stiff_bent) .or. march%state%clock%i_step == 0) return
      call bending_measure(bending, solid, march%system%space%body, scene%x, march%state%u, &
         step_square(scene%step(march%state%clock%i_step)))
      do b = 1, size(bending%strain)
         if (.not. bending%strain(b) > rounding*largest_energy) cycle
         if (.not. bending%missed(b) > told_part*bending%strain(b)) cycle
         found%body = b
         found%label = solid%deck%label(bending%element(b))
         found%percent = 100.0_wp*bending%missed(b)/bending%strain(b)
         found%advice = trim(bending_advice(solid))
         return
      end do
   end subroutine bent_body_find

end module emcon_bent_bodies
