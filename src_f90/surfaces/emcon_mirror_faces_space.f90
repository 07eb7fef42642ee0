!> Faces that lie in planes of symmetry: the body goes on behind them as its own mirror image. What
!> is a corner of the model there is none of the body that it stands for, and what rests along the
!> same axis as such a face comes no nearer to it.
module emcon_mirror_faces_space
   use emcon_facets, only : facets_normal, facets_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_steps, only : prescribed_rests
   implicit none
   private
   public :: mirror_axes, always_rests

   integer, parameter :: n_axis = 3
   !> A face is normal to an axis if the cosine of the angle between is as near to 1.
   real(wp), parameter :: straight = sqrt(epsilon(1.0_wp))

contains

   !> The axis along which all nodes of a facet rest in all steps where it is the facet's normal and
   !> they can move in its plane; 0: there is none. Of supports along turned axes none is found.
   pure function mirror_axes(facets, scene) result(axis)
      type(facets_t), intent(in) :: facets       !! in space
      type(scene_t), intent(in) :: scene
      integer :: axis(facets%n_facet)            !! 1 to 3
      real(wp) :: normal(n_axis), still(n_axis, size(scene%x, 2))
      logical :: rests(n_axis, size(scene%x, 2))
      integer :: f, n

      rests = always_rests(scene)
      still = 0.0_wp
      do f = 1, facets%n_facet
         n = count(facets%facet(:, f) > 0)
         normal = abs(facets_normal(facets, f, scene%x, still))
         axis(f) = maxloc(normal, 1)
         associate (own => facets%facet(:n, f))
            if (.not. normal(axis(f)) >= (1.0_wp - straight)*facets%size(f) .or. &
               .not. all(rests(axis(f), own)) .or. all(rests(:, own))) axis(f) = 0
         end associate
      end do
   end function mirror_axes

   !> The freedoms that rest in every step; those of a rigid body do as its reference node and its
   !> turns.
   pure function always_rests(scene) result(rests)
      type(scene_t), intent(in) :: scene
      logical :: rests(n_axis, size(scene%x, 2)), now(n_axis, size(scene%x, 2))
      integer :: i, k

      rests = .false.
      if (.not. allocated(scene%step)) return
      rests = size(scene%step) > 0
      do i = 1, size(scene%step)
         now = .false.
         do k = 1, size(scene%step(i)%prescribed)
            associate (own => scene%step(i)%prescribed(k))
               now(own%dof, own%node) = prescribed_rests(own)
            end associate
         end do
         if (allocated(scene%step(i)%turn)) call let_turns_rest(scene, i, now)
         rests = rests .and. now
      end do
   end function always_rests

   !> Let rigid bodies rest whose reference node and turns do in a step.
   pure subroutine let_turns_rest(scene, i, now)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i                   !! number of the step
      logical, intent(inout) :: now(:, :)        !! (3, n_node) what rests in it
      integer :: k

      do k = 1, size(scene%step(i)%turn)
         associate (turn => scene%step(i)%turn(k))
            if (turn%axis > 0 .or. .not. all(prescribed_rests(turn%angle))) cycle
            associate (body => scene%rigid(turn%rigid))
               if (all(now(:, body%reference))) now(:, body%node) = .true.
            end associate
         end associate
      end do
   end subroutine let_turns_rest

end module emcon_mirror_faces_space
