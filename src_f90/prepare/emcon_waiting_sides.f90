!> Of a pair without mass at its surfaces: the half whose nodes are guarded, not held.
!>
!> Source: docs/theory.md, section 6.4.
module emcon_waiting_sides
   use emcon_interactions, only : contact_pair_t, pair_has_order
   use emcon_kinds, only : wp
   use emcon_massless_surfaces, only : pair_sheds_mass, surface_keeps_mass
   use emcon_scene, only : scene_t
   use emcon_surface_shape_plane, only : surface_shape, surface_shape_t
   use emcon_surface_shape_space, only : surface_size
   implicit none
   private
   public :: find_waiting

   integer, parameter :: n_space = 3
   !> Surfaces whose facets differ in length by less than this part stand equally dense.
   real(wp), parameter :: as_dense = 1.0e-6_wp

contains

   !> Why the nodes of the slave of `pair`, a half of one that holds both sides, wait for those of
   !> its master; "": they do not. As rows beside those of massless nodes they would be a second one
   !> on the same nodes, which cannot follow both. Denser ones would go in between massless nodes.
   subroutine find_waiting(scene, pair, is_second, why)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      logical, intent(in) :: is_second           !! of the two halves, as the deck has them
      character(len=:), allocatable, intent(out) :: why  !! to follow on the name of the slave
      real(wp) :: slave, master
      logical :: keeps

      why = ""
      if (pair_has_order(pair) .or. pair%slave == pair%master) return
      if (pair%is_asked .and. .not. pair%may_choose) return
      if (.not. pair_sheds_mass(scene, pair)) return
      if (surface_keeps_mass(scene, pair%master)) return
      keeps = surface_keeps_mass(scene, pair%slave)
      ! In the plane both are held where neither keeps its mass.
      if (.not. keeps .and. scene%n_dim /= n_space) return
      slave = mean_length(scene, pair%slave)
      master = mean_length(scene, pair%master)
      associate (name => scene%surface(pair%master)%name)
         if (keeps) then
            if (slave >= master) why = "keeps its mass, which " // name // " does not"
         else if (slave > master + as_dense*master .or. (is_second .and. &
            slave >= master - as_dense*master)) then
            why = "stands no denser than " // name // ", and of two without mass one is held"
         end if
      end associate
   end subroutine find_waiting

   !> The length of a mean facet, times a power of two that is one for all surfaces of a scene.
   real(wp) function mean_length(scene, surface) result(length)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: surface             !! its number
      type(surface_shape_t) :: shape
      real(wp) :: area

      if (scene%n_dim == n_space) then
         call surface_size(scene, scene%surface(surface), area, length)
      else
         shape = surface_shape(scene, scene%surface(surface))
         length = shape%mean
      end if
   end function mean_length

end module emcon_waiting_sides
