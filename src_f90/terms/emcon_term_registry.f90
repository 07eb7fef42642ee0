!> The registry of the terms of a model: what others see of it, and what some of them are asked for
!> by name. Which kinds there are is known to `emcon_term_kinds` alone.
module emcon_term_registry
   use emcon_csr, only : csr_t
   use emcon_errors, only : error_t
   use emcon_host, only : host_t
   use emcon_kinds, only : dp, wp
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_t
   use emcon_term, only : term_box_t
   implicit none
   private
   public :: terms_create, terms_solid, terms_mass, terms_mass_rows, terms_mass_times, &
      terms_mass_values, terms_massless, terms_return_mass, terms_dissipation, &
      terms_stabilization

   interface
      !> The terms of `scene`, and of what it is given.
      module subroutine terms_create(scene, term, error, host)
         type(scene_t), intent(in) :: scene
         type(term_box_t), allocatable, intent(out) :: term(:)   !! (n_term)
         type(error_t), allocatable, intent(out) :: error
         type(host_t), intent(in), optional :: host
      end subroutine terms_create

      !> The elements, for what is derived from them.
      module function terms_solid(term) result(solid)
         type(term_box_t), intent(in), target :: term(:)   !! of `terms_create`
         type(solid_t), pointer :: solid
      end function terms_solid

      !> The mass between nodes, the same in all directions.
      pure module subroutine terms_mass(term, mass)
         type(term_box_t), intent(in) :: term(:)    !! of `terms_create`
         type(csr_t), intent(out) :: mass           !! (n_node x n_node) [M]
      end subroutine terms_mass

      !> Mass at each node: the sums of rows.
      pure module subroutine terms_mass_rows(term, mass)
         type(term_box_t), intent(in) :: term(:)    !! of `terms_create`
         real(wp), intent(out) :: mass(:)           !! (n_node) [M]
      end subroutine terms_mass_rows

      !> M field, in all directions.
      pure module subroutine terms_mass_times(term, field, product)
         type(term_box_t), intent(in) :: term(:)    !! of `terms_create`
         real(wp), intent(in), contiguous :: field(:, :)      !! (n_dim, n_node)
         real(wp), intent(out), contiguous :: product(:, :)   !! (n_dim, n_node)
      end subroutine terms_mass_times

      !> The mass between unknowns of the step, in the pattern of the matrix.
      pure module subroutine terms_mass_values(term, value)
         type(term_box_t), intent(in) :: term(:)    !! of `terms_create`
         real(dp), allocatable, intent(out) :: value(:)   !! (entries of the matrix) [M]
      end subroutine terms_mass_values

      !> The nodes that contact finds without mass: those that have given theirs to their
      !> neighbours, and of sections without inertia.
      pure module subroutine terms_massless(term, is_massless, without_density)
         type(term_box_t), intent(in) :: term(:)    !! of `terms_create`
         logical, intent(out) :: is_massless(:)     !! (n_node)
         !> (n_node) of such sections, whatever contact does
         logical, intent(out) :: without_density(:)
      end subroutine terms_massless

      !> Let the nodes `has_mass`, which had given theirs away, have mass again, and the others not.
      !> The step of the deck has to begin anew.
      module subroutine terms_return_mass(term, may_be_massless, has_mass, error)
         type(term_box_t), intent(inout), target :: term(:)   !! of `terms_create`
         logical, intent(in) :: may_be_massless(:)  !! (n_node) those of `terms_massless` at first
         logical, intent(in) :: has_mass(:)         !! (n_node) of these
         type(error_t), allocatable, intent(out) :: error
      end subroutine terms_return_mass

      !> What the damping of the scheme has taken in the last motion, and that of materials.
      pure module subroutine terms_dissipation(term, work, damping)
         type(term_box_t), intent(in) :: term(:)    !! of `terms_create`
         real(wp), intent(out) :: work, damping     !! [M L^2/T^2]
      end subroutine terms_dissipation

      !> What the viscous stress of STABILIZE has taken in the last motion, and its forces.
      pure module subroutine terms_stabilization(term, work, force)
         type(term_box_t), intent(in) :: term(:)    !! of `terms_create`
         real(wp), intent(out) :: work              !! [M L^2/T^2]
         real(wp), intent(out), optional :: force(:, :)   !! (n_dim, n_node) [M L/T^2]
      end subroutine terms_stabilization
   end interface

end module emcon_term_registry
